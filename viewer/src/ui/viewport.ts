/** Where the picture lies in the element: places, pans and zooms of a view. */

import type { View } from "../gl/scene";
import { clamp } from "./state";

const LARGEST_SCALE = 32;

/** The canvas that a view is seen in. */
export interface Viewport {
  /** Pixels of the canvas, and of each of its panes. */
  readonly width: number;
  readonly height: number;
  readonly pane: number;
  /** Pixels of the canvas per pixel of the page. */
  readonly ratio: number;
}

interface Size {
  readonly width: number;
  readonly height: number;
}

/** The view that shows the whole picture. */
export function fitted({ pane, height }: Viewport, picture: Size): View {
  const scale = Math.min(pane / picture.width, height / picture.height);
  return { x: picture.width / 2, y: picture.height / 2, scale };
}

/** The place in the picture, in its pixels, that lies under a place in the element. */
export function toPicture(
  { pane, height, ratio }: Viewport,
  view: View,
  x: number,
  y: number,
): [number, number] {
  const across = (x * ratio) % pane;
  return [view.x + (across - pane / 2) / view.scale, view.y + (y * ratio - height / 2) / view.scale];
}

/** The place in the element under which a place of the picture lies. */
export function toPage(
  { pane, height, ratio }: Viewport,
  view: View,
  x: number,
  y: number,
): [number, number] {
  return [((x - view.x) * view.scale + pane / 2) / ratio, ((y - view.y) * view.scale + height / 2) / ratio];
}

/** Moves the picture by pixels of the page. */
export function panned({ ratio }: Viewport, view: View, picture: Size, dx: number, dy: number): View {
  return {
    ...view,
    x: clamp(view.x - (dx * ratio) / view.scale, 0, picture.width),
    y: clamp(view.y - (dy * ratio) / view.scale, 0, picture.height),
  };
}

/** Zooms about a place in the element, which stays where it is. */
export function zoomed(
  viewport: Viewport,
  view: View,
  picture: Size,
  factor: number,
  x: number,
  y: number,
): View {
  const { pane, height } = viewport;
  const least = Math.min(pane / picture.width, height / picture.height, 1) / 2;
  const scale = clamp(view.scale * factor, least, LARGEST_SCALE);
  const [px, py] = toPicture(viewport, view, x, y);
  const kept = view.scale / scale;
  return { x: px + (view.x - px) * kept, y: py + (view.y - py) * kept, scale };
}
