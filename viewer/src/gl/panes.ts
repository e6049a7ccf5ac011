/** The panes of a frame, and which tiles each of them needs. */

import type { Layer, PublishedStore } from "../store/published";
import type { Content, Scene, View } from "./scene";
import { bytesOf, type TileKey } from "./tiles";

/** Share of the memory that the tiles of one frame may take, so that those just left stay. */
const SHARE = 0.6;

export interface Pane {
  readonly content: Content;
  /** What it is drawn from, and the residual term that is added. */
  readonly layer: Layer;
  readonly residual: Layer | null;
  /** In pixels of the canvas from its left and top. */
  readonly left: number;
  readonly width: number;
  readonly height: number;
  /** What of it is drawn. */
  readonly clip: readonly [number, number];
}

export interface Needed {
  readonly coarsest: TileKey[];
  readonly visible: TileKey[];
  readonly around: TileKey[];
}

/** Returns one pane, or two side by side or either side of the swipe line. */
export function panesOf(scene: Scene, store: PublishedStore, width: number, height: number): Pane[] {
  const [first, second] = scene.contents;
  const pane = (content: Content, left: number, over: number, clip: [number, number]): Pane => ({
    content,
    layer: layerOf(content, store),
    residual: content.kind === "model" && content.residual ? store.residual(content.model) : null,
    left,
    width: over,
    height,
    clip,
  });
  if (!second) return [pane(first, 0, width, [0, width])];
  if (scene.swipe === null) {
    const half = Math.floor(width / 2);
    return [pane(first, 0, half, [0, half - 1]), pane(second, half, width - half, [half + 1, width])];
  }
  const line = Math.round(scene.swipe * width);
  return [pane(first, 0, width, [0, line]), pane(second, 0, width, [line, width])];
}

function layerOf(content: Content, store: PublishedStore): Layer {
  if (content.kind === "photograph") return store.photograph(content.light);
  if (content.kind === "column" && content.of === "height") return store.heights()!;
  const quality = content.kind === "column" && content.of === "quality";
  return store.layer(content.model, quality ? "quality" : "parameters");
}

/** Returns the tiles of a pane in the order in which they are wanted; `memory` in bytes is for all of `panes` panes. */
export function neededBy(
  pane: Pane,
  view: View,
  store: PublishedStore,
  memory: number,
  panes: number,
): Needed {
  const { layer } = pane;
  const level = levelFor(pane, view.scale, memory / panes);
  const left = view.x - pane.width / 2 / view.scale;
  const top = view.y - pane.height / 2 / view.scale;
  const box = [left, top, left + pane.width / view.scale, top + pane.height / view.scale] as const;
  const inside = (at: number, ring: number) => tilesInside(layer, at, box, ring, view, store);
  const visible = inside(level, 0);
  const finer = level > layer.levels[0]! ? inside(level - 1, 0).slice(0, 4) : [];
  return {
    coarsest: inside(layer.levels[layer.levels.length - 1]!, 0),
    visible: [...visible, ...residualOf(pane, visible)],
    around: [...inside(level, 1), ...finer],
  };
}

/** The residual's tiles over the same places. */
export function residualOf({ residual }: Pane, keys: readonly TileKey[]): TileKey[] {
  return residual ? keys.map((key) => ({ ...key, layer: residual })) : [];
}

/** The level that a view needs: its pixels at most a little larger than those of the canvas. */
function levelFor({ layer, residual, width, height }: Pane, scale: number, memory: number): number {
  const { levels } = layer;
  const finest = levels[0]!;
  const coarsest = levels[levels.length - 1]!;
  let level = Math.min(Math.max(Math.floor(-Math.log2(scale) + 0.3), finest), coarsest);
  const room = (SHARE * memory) / (bytesOf(layer) + (residual ? bytesOf(residual) : 0));
  const count = (at: number) => {
    const step = layer.chunk * 2 ** at * scale;
    return (width / step + 1) * (height / step + 1);
  };
  while (level < coarsest && count(level) > room) level++;
  return level;
}

/** Tiles of a level that meet a box of the picture, `ring` tiles around it too; the nearest to its middle first. */
function tilesInside(
  layer: Layer,
  level: number,
  box: readonly number[],
  ring: number,
  view: View,
  store: PublishedStore,
): TileKey[] {
  const [height, width] = store.size(level);
  const size = layer.chunk * 2 ** level;
  const [left, top, right, bottom] = box.map((edge) => edge / size) as [number, number, number, number];
  const keys: TileKey[] = [];
  const rows = Math.ceil(height / layer.chunk);
  const columns = Math.ceil(width / layer.chunk);
  for (let row = Math.max(Math.floor(top) - ring, 0); row < Math.min(bottom + ring, rows); row++) {
    const first = Math.max(Math.floor(left) - ring, 0);
    for (let column = first; column < Math.min(right + ring, columns); column++) {
      keys.push({ layer, level, row, column });
    }
  }
  const away = ({ row, column }: TileKey) =>
    Math.hypot(row + 0.5 - view.y / size, column + 0.5 - view.x / size);
  return keys.sort((a, b) => away(a) - away(b));
}
