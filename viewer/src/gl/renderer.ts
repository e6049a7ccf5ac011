/** Draws a scene from tiles: at every place the finest that is there. */

import { findModel } from "../models";
import type { Attributes, Column, GlossTable, Layer, ModelEntry, PublishedStore } from "../store/published";
import { colourMap } from "./colour-map";
import { floatTexture, nearest, Program } from "./program";
import type { Content, Scene, View } from "./scene";
import { COLUMN_FRAGMENT, MODES, modelFragment, TILE_VERTEX } from "./shaders";
import { bytesOf, type Tile, type TileKey, Tiles } from "./tiles";

/** Share of the memory that the tiles of one frame may take, so that those just left stay. */
const SHARE = 0.6;
const GLOSS_ANGLE = 60;
/** How many levels coarser the normals are that others are compared with. */
const BLUR_LEVELS = 3;

interface Pane {
  readonly content: Content;
  readonly layer: Layer;
  /** In pixels of the canvas from its left and top. */
  readonly left: number;
  readonly width: number;
  /** What of it is drawn. */
  readonly clip: readonly [number, number];
}

export class Renderer {
  readonly gl: WebGL2RenderingContext;
  readonly tiles: Tiles;
  readonly #programs = new Map<string, Program>();
  readonly #gloss = new Map<string, WebGLTexture>();
  readonly #colours: WebGLTexture;
  readonly #attributes: Attributes;

  constructor(
    gl: WebGL2RenderingContext,
    readonly store: PublishedStore,
    memory: number,
  ) {
    this.gl = gl;
    this.tiles = new Tiles(gl, store, memory);
    this.#attributes = store.attributes;
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.#colours = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.#colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colourMap());
    nearest(gl);
  }

  dispose(): void {
    this.tiles.dispose();
    this.gl.deleteTexture(this.#colours);
    for (const texture of this.#gloss.values()) this.gl.deleteTexture(texture);
    for (const program of this.#programs.values()) this.gl.deleteProgram(program.handle);
  }

  /** The layer that a content is drawn from. */
  layerOf(content: Content): Layer {
    if (content.kind === "photograph") return this.store.photograph(content.light);
    if (content.kind === "column" && content.of === "height") return this.store.heights()!;
    return this.store.layer(
      content.model,
      content.kind === "column" && content.of === "quality" ? "quality" : "parameters",
    );
  }

  /** Draws what is there and asks for what is not; returns whether the frame is complete. */
  draw(scene: Scene): boolean {
    const { gl, tiles } = this;
    tiles.begin();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.SCISSOR_TEST);
    const panes = this.#panes(scene);
    const wanted: TileKey[][] = [[], [], []];
    let complete = true;
    for (const pane of panes) {
      const { coarsest, visible, around } = this.#tilesOf(pane, scene.view, panes.length);
      wanted[0]!.push(...coarsest);
      wanted[1]!.push(...visible);
      wanted[2]!.push(...around);
      const [from, to] = pane.clip;
      gl.scissor(from, 0, to - from, gl.drawingBufferHeight);
      complete = this.#drawPane(pane, scene, visible, coarsest) && complete;
    }
    // What is asked for has to fit at once, or tiles would push each other out for ever.
    let room = tiles.limit;
    const fitting = wanted.flat().filter((key) => {
      room -= bytesOf(key.layer);
      return room >= 0;
    });
    for (const key of fitting) tiles.get(key);
    tiles.want(fitting);
    return complete;
  }

  #panes(scene: Scene): Pane[] {
    const width = this.gl.drawingBufferWidth;
    const [first, second] = scene.contents;
    const pane = (content: Content, left: number, over: number, clip: [number, number]): Pane => ({
      content,
      layer: this.layerOf(content),
      left,
      width: over,
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

  /** The level that a view needs: its pixels at most a little larger than those of the canvas. */
  levelFor(layer: Layer, scale: number, width: number, panes: number): number {
    const levels = layer.levels;
    const finest = levels[0]!;
    const coarsest = levels[levels.length - 1]!;
    let level = Math.min(Math.max(Math.floor(-Math.log2(scale) + 0.3), finest), coarsest);
    const room = (SHARE * this.tiles.limit) / panes / bytesOf(layer);
    const count = (at: number) => {
      const step = layer.chunk * 2 ** at * scale;
      return (width / step + 1) * (this.gl.drawingBufferHeight / step + 1);
    };
    while (level < coarsest && count(level) > room) level++;
    return level;
  }

  #tilesOf(pane: Pane, view: View, panes: number) {
    const { layer } = pane;
    const level = this.levelFor(layer, view.scale, pane.width, panes);
    const height = this.gl.drawingBufferHeight;
    const left = view.x - pane.width / 2 / view.scale;
    const top = view.y - height / 2 / view.scale;
    const box = [left, top, left + pane.width / view.scale, top + height / view.scale] as const;
    const last = layer.levels[layer.levels.length - 1]!;
    const visible = this.#inside(layer, level, box, 0, view);
    const around = [
      ...this.#inside(layer, level, box, 1, view),
      ...(level > layer.levels[0]! ? this.#inside(layer, level - 1, box, 0, view).slice(0, 4) : []),
    ];
    return { coarsest: this.#inside(layer, last, box, 0, view), visible, around };
  }

  /** Tiles of a level that meet a box of the picture, `ring` tiles around it too; the nearest to its middle first. */
  #inside(layer: Layer, level: number, box: readonly number[], ring: number, view: View): TileKey[] {
    const [height, width] = this.store.size(level);
    const size = layer.chunk * 2 ** level;
    const [left, top, right, bottom] = box.map((edge) => edge / size) as [number, number, number, number];
    const keys: TileKey[] = [];
    const rows = Math.ceil(height / layer.chunk);
    const columns = Math.ceil(width / layer.chunk);
    for (let row = Math.max(Math.floor(top) - ring, 0); row < Math.min(bottom + ring, rows); row++) {
      for (
        let column = Math.max(Math.floor(left) - ring, 0);
        column < Math.min(right + ring, columns);
        column++
      ) {
        keys.push({ layer, level, row, column });
      }
    }
    const away = ({ row, column }: TileKey) =>
      Math.hypot(row + 0.5 - view.y / size, column + 0.5 - view.x / size);
    return keys.sort((a, b) => away(a) - away(b));
  }

  #drawPane(pane: Pane, scene: Scene, visible: TileKey[], coarsest: TileKey[]): boolean {
    const finest = visible[0]?.level ?? 0;
    const there = visible.map((key) => this.tiles.get(key));
    const complete = there.every((tile) => tile !== undefined);
    const program = this.#prepare(pane, scene);
    if (!complete) {
      const between: Tile[] = [];
      for (const key of visible) {
        for (let level = finest + 1; level <= pane.layer.levels[pane.layer.levels.length - 1]!; level++) {
          const up = level - finest;
          const tile = this.tiles.get({ ...key, level, row: key.row >> up, column: key.column >> up });
          if (tile && !between.includes(tile)) between.push(tile);
        }
      }
      between.sort((a, b) => b.level - a.level);
      for (const tile of between) this.#drawTile(program, pane, scene, tile);
    }
    for (const tile of there) if (tile) this.#drawTile(program, pane, scene, tile);
    // Coarser tiles stay, so that there is something to show wherever the view goes.
    for (const key of coarsest) this.tiles.get(key);
    return complete;
  }

  #program(name: string, fragment: () => string): Program {
    let program = this.#programs.get(name);
    if (!program) {
      program = new Program(this.gl, TILE_VERTEX, fragment());
      this.#programs.set(name, program);
    }
    return program;
  }

  #prepare({ content, layer }: Pane, scene: Scene): Program {
    const { gl } = this;
    const channels = this.#attributes.light_rgb.length;
    const program =
      content.kind === "model"
        ? this.#program(content.model.name, () =>
            modelFragment(findModel(content.model.base)!, content.model.parameters, channels),
          )
        : this.#program("", () => COLUMN_FRAGMENT);
    program.use();
    const coding = new Float32Array(3 * layer.columns.length);
    layer.columns.forEach((column: Column, i) => {
      coding.set([column.offset, column.scale, column.transfer === "log" ? 1 : 0], 3 * i);
    });
    gl.uniform3fv(program.at("coding"), coding);
    this.#prepareDisplay(program, scene);
    if (content.kind === "photograph") {
      program.int("column", 0);
      program.int("channels", channels);
      return program;
    }
    const { low, high, logarithmic } = content.range;
    program.vector("range", [low, high, logarithmic ? 1 : 0]);
    if (content.kind === "column") {
      program.int("column", content.column);
      program.int("channels", 0);
      return program;
    }
    this.#prepareModel(program, content.model, scene);
    program.int("mode", MODES[content.mode]);
    return program;
  }

  #prepareDisplay(program: Program, scene: Scene): void {
    const { gl } = this;
    const rows = this.#attributes.display.matrix;
    const columns = (start: number) =>
      new Float32Array([0, 1, 2].flatMap((j) => rows.map((row) => row[start + j] ?? 0)));
    gl.uniformMatrix3fv(program.at("toDisplay"), false, columns(0));
    gl.uniformMatrix3fv(program.at("toDisplayRoots"), false, columns(3));
    program.float("exposure", scene.exposure);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.#colours);
    program.int("codes", 0);
    program.int("colourMap", 1);
    program.int("coarse", 2);
    program.int("glossTable", 3);
  }

  #prepareModel(program: Program, model: ModelEntry, scene: Scene): void {
    const { gl } = this;
    const places = new Float32Array(scene.lights.flatMap((light) => [...light.place, light.near ? 1 : 0]));
    gl.uniform4fv(program.at("lightPlace"), places);
    gl.uniform3fv(
      program.at("lightColour"),
      new Float32Array(scene.lights.flatMap((light) => [...light.colour])),
    );
    program.int("lightCount", scene.lights.length);
    const { view_direction: direction, distance_mm: distance } = this.#attributes.camera;
    program.vector("camera", [...direction.map((x) => x * (distance ?? 1)), distance === null ? 0 : 1]);
    program.vector("specularColour", rgb(model.light_rgb));
    program.float("optics.index", model.index_of_refraction);
    program.int("optics.element", model.fresnel === "element" ? 1 : 0);
    const azimuth = ((model.sample?.arm_azimuth_deg ?? 0) * Math.PI) / 180;
    program.vector("armAzimuth", [Math.cos(azimuth), Math.sin(azimuth)]);
    program.int("samples", scene.smooth ? 2 : 1);
    program.float("exaggeration", scene.exaggeration);
    const table = model.gloss.find((each) => each.angle_deg === GLOSS_ANGLE);
    if (table && table.axes.length <= 2) {
      gl.activeTexture(gl.TEXTURE3);
      gl.bindTexture(gl.TEXTURE_2D, this.#glossTexture(model, table));
      const axis = (i: number) => {
        const { low, high } = table.axes[i] ?? { low: 1, high: Math.E };
        return [Math.log(low), Math.log(high / low)];
      };
      program.vector("glossAxes", [...axis(0), ...axis(1)]);
    }
  }

  #glossTexture(model: ModelEntry, table: GlossTable): WebGLTexture {
    let texture = this.#gloss.get(model.name);
    if (!texture) {
      // The second parameter runs fastest in the store, the first along x in the texture.
      const width = table.axes[0]?.count ?? 1;
      const height = table.axes[1]?.count ?? 1;
      const per = 1 + model.lobes;
      const values = new Float32Array(4 * width * height);
      for (let x = 0; x < width; x++) {
        for (let y = 0; y < height; y++) {
          for (let i = 0; i < per; i++) {
            values[4 * (y * width + x) + i] = Math.log(table.values[(x * height + y) * per + i]! + 1e-30);
          }
        }
      }
      texture = floatTexture(this.gl, width, height, values);
      this.#gloss.set(model.name, texture);
    }
    return texture;
  }

  #drawTile(program: Program, pane: Pane, scene: Scene, tile: Tile): void {
    const { gl } = this;
    const { view } = scene;
    const size = 2 ** tile.level;
    const chunk = tile.layer.chunk;
    const height = gl.drawingBufferHeight;
    // The last pixels of a level may stand for fewer of the picture's than the others.
    const right = Math.min((tile.column * chunk + tile.width) * size, this.store.width);
    const bottom = Math.min((tile.row * chunk + tile.height) * size, this.store.height);
    const left = tile.column * chunk * size;
    const top = tile.row * chunk * size;
    gl.viewport(pane.left, 0, pane.width, height);
    const x = (px: number) => ((px - view.x) * view.scale * 2) / pane.width;
    const y = (px: number) => (-(px - view.y) * view.scale * 2) / height;
    program.vector("place", [x(left), y(top), x(right), y(bottom)]);
    program.vector("part", [0, 0, (right - left) / size, (bottom - top) / size]);
    program.int("blocks", tile.blocks);
    gl.uniform2i(program.at("last"), tile.width - 1, tile.height - 1);
    const mm = this.#attributes.camera.mm_per_px ?? 0;
    program.vector("position", [
      (left + (size - 1) / 2 - (this.store.width - 1) / 2) * mm,
      -(top + (size - 1) / 2 - (this.store.height - 1) / 2) * mm,
      size * mm,
      -size * mm,
    ]);
    const around = scene.exaggeration > 0 && pane.content.kind === "model" ? this.#around(tile) : tile;
    const factor = 2 ** (tile.level - around.level);
    program.vector("coarsePlace", [
      factor,
      left / 2 ** around.level - around.column * chunk,
      top / 2 ** around.level - around.row * chunk,
      (around.width - 1) | ((around.height - 1) << 10),
    ]);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, around.texture);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, tile.texture);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /** A coarser tile over the same place, the tile itself where there is none. */
  #around(tile: Tile): Tile {
    for (let up = BLUR_LEVELS; up > 0; up--) {
      const key = { ...tile, level: tile.level + up, row: tile.row >> up, column: tile.column >> up };
      const coarser = this.tiles.get(key);
      if (coarser) return coarser;
    }
    return tile;
  }
}

function rgb(values: readonly number[]): [number, number, number] {
  return values.length === 3 ? (values as [number, number, number]) : [values[0]!, values[0]!, values[0]!];
}
