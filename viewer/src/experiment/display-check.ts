// The display, checked by eye: steps near black and white, neutral grey, gamma, and the size of a pixel.

import { make } from "./dom";
import { choice, form, number, value } from "./form";

export interface DisplayCheck {
  dark_steps_seen: number;
  bright_steps_seen: number;
  grey_is_neutral: boolean;
  gamma: number | null;
  px_per_mm: number | null;
}

const STEPS = 8;
const STEP = 2; // codes between neighbouring patches
const CARD_MM = { width: 85.6, height: 53.98 }; // ISO/IEC 7810, ID-1: bank cards, many identity cards
const USUAL_PX_PER_MM = 96 / 25.4;

/** Return the gamma of a display on which a code looks as bright as lines of black and white in turn. */
export function gammaOf(code: number): number {
  return Math.log(0.5) / Math.log(code / 255);
}

/** Return the code that lines of black and white in turn are as bright as, on a display of a gamma. */
export function codeOf(gamma: number): number {
  return 255 * 0.5 ** (1 / gamma);
}

function ramp(from: number, direction: number): HTMLElement {
  const patches = Array.from({ length: STEPS }, (_, index) => {
    const code = from + direction * STEP * (index + 1);
    return make("i", { style: `background: rgb(${code} ${code} ${code})` });
  });
  return make("div", { class: "ramp", style: `background: rgb(${from} ${from} ${from})` }, ...patches);
}

/** Draw lines of black and white, one pixel of the display each, around a patch of one grey. */
function drawGamma(canvas: HTMLCanvasElement, code: number): void {
  const ratio = window.devicePixelRatio;
  const side = canvas.width;
  canvas.style.width = `${side / ratio}px`;
  const context = canvas.getContext("2d")!;
  for (let row = 0; row < side; row++) {
    context.fillStyle = row % 2 ? "#fff" : "#000";
    context.fillRect(0, row, side, 1);
  }
  context.fillStyle = `rgb(${code} ${code} ${code})`;
  context.fillRect(side / 4, side / 4, side / 2, side / 2);
}

/** Show the page of checks, and return what was seen. */
export async function checkDisplay(display: HTMLElement): Promise<DisplayCheck> {
  const counts = Array.from({ length: STEPS + 1 }, (_, n): [string, string] => [String(n), String(n)]);
  const canvas = make("canvas", { width: 200, height: 200 });
  const gamma = make("input", {
    type: "range",
    name: "gamma",
    min: 1.4,
    max: 3,
    step: 0.02,
    value: 1.8,
    "aria-label": "Brightness of the inner square",
  });
  const card = make("div", { class: "id-card" }, "card");
  const size = make("input", {
    type: "range",
    name: "px_per_mm",
    min: 2,
    max: 10,
    step: 0.01,
    value: USUAL_PX_PER_MM,
    "aria-label": "Size of the card",
  });
  const untouched = new Set(["gamma", "px_per_mm"]);
  const draw = () => {
    drawGamma(canvas, Math.round(codeOf(Number(gamma.value))));
    card.style.width = `${CARD_MM.width * Number(size.value)}px`;
    card.style.height = `${CARD_MM.height * Number(size.value)}px`;
  };
  for (const slider of [gamma, size]) {
    slider.addEventListener("input", () => {
      untouched.delete(slider.name);
      draw();
    });
  }
  draw();
  const section = (title: string, ...content: Node[]) =>
    make("section", {}, make("h2", {}, title), ...content);
  const filled = await form(display, "Check of the display", [
    section(
      "Dark steps",
      ramp(0, 1),
      choice("How many of the 8 squares can you tell from the black around them?", "dark", counts),
    ),
    section(
      "Bright steps",
      ramp(255, -1),
      choice("How many of the 8 squares can you tell from the white around them?", "bright", counts),
    ),
    section(
      "White point",
      make("div", { class: "neutral" }),
      choice("Does this field look grey, without a tint?", "neutral", [
        ["yes", "Yes"],
        ["no", "No, it is tinted"],
      ]),
    ),
    section(
      "Gamma",
      canvas,
      make(
        "p",
        {},
        "Step back, and move the slider until the inner square is as bright as the lines around it.",
      ),
      gamma,
    ),
    section(
      "Scale",
      make("p", {}, "Hold a bank card to the display, and move the slider until the frame has its size."),
      card,
      size,
    ),
  ]);
  return {
    dark_steps_seen: Number(value(filled, "dark")),
    bright_steps_seen: Number(value(filled, "bright")),
    grey_is_neutral: value(filled, "neutral") === "yes",
    // What nobody moved is not a measurement.
    gamma: untouched.has("gamma") ? null : gammaOf(Math.round(codeOf(number(filled, "gamma")!))),
    px_per_mm: untouched.has("px_per_mm") ? null : number(filled, "px_per_mm"),
  };
}
