/** What a frame shows. Lengths in mm, angles in radians, in the painting's frame (docs/notation.md). */

import type { ModelEntry } from "../store/attributes";
import type { Mode } from "./model-shader";

export interface View {
  /** Pixel of the picture in the middle of the canvas; 0 is the left or top edge. */
  readonly x: number;
  readonly y: number;
  /** Pixels of the canvas per pixel of the picture. */
  readonly scale: number;
}

/** A light as the shader takes it: far away in a direction, or at a position in mm. */
export interface ShaderLight {
  readonly place: readonly [number, number, number];
  readonly near: boolean;
  /** Irradiance per channel, in the camera's space. */
  readonly colour: readonly [number, number, number];
}

export interface Range {
  readonly low: number;
  readonly high: number;
  /** `diverging` runs from −high to high, with a colour of its own for 0. */
  readonly scale: "linear" | "logarithmic" | "diverging";
}

export type Content =
  | {
      readonly kind: "model";
      readonly model: ModelEntry;
      readonly mode: Mode;
      readonly range: Range;
      /** Whether to add what the model leaves over, where the store has it. */
      readonly residual: boolean;
    }
  | {
      readonly kind: "column";
      readonly model: ModelEntry;
      readonly of: "parameters" | "quality" | "height";
      readonly column: number;
      readonly range: Range;
    }
  | { readonly kind: "photograph"; readonly light: number };

export interface Scene {
  readonly view: View;
  /** One picture, or two: side by side, or the second right of the swipe line. */
  readonly contents: readonly [Content] | readonly [Content, Content];
  /** Where the swipe line is, 0 to 1; null shows two pictures side by side. */
  readonly swipe: number | null;
  readonly lights: readonly ShaderLight[];
  readonly exposure: number;
  readonly exaggeration: number;
  /** Whether nothing has changed for a while: only then are tiles asked for that may be wanted next. */
  readonly still: boolean;
  /** Whether to blend neighbouring pixels, which takes four times as long. */
  readonly smooth: boolean;
}
