// Rings with a gap, row by row smaller, at the distance and scale of the display.

import { make } from "./dom";
import { form } from "./form";

export interface AcuityRow {
  logmar: number;
  shown: number;
  right: number;
}

const SIZES = [0.6, 0.4, 0.3, 0.2, 0.1, 0];
const RINGS = 4;
/** Pixels of the display that a gap needs to be one. */
const LEAST_GAP_PX = 2;

const ARROWS: Record<string, number> = { ArrowRight: 0, ArrowDown: 1, ArrowLeft: 2, ArrowUp: 3 };

/** Return the width of a gap in CSS pixels; logMAR 0 is one minute of arc. */
export function gapPx(logmar: number, distanceMm: number, pxPerMm: number): number {
  return 2 * distanceMm * Math.tan((10 ** logmar / 60 / 2) * (Math.PI / 180)) * pxPerMm;
}

function ring(canvas: HTMLCanvasElement, gap: number, turn: number): void {
  const ratio = window.devicePixelRatio;
  const side = Math.ceil(7 * gap * ratio);
  canvas.width = canvas.height = side;
  canvas.style.width = canvas.style.height = `${side / ratio}px`;
  const context = canvas.getContext("2d")!;
  context.setTransform(ratio, 0, 0, ratio, side / 2, side / 2);
  context.rotate((turn * Math.PI) / 2);
  context.lineWidth = gap;
  context.beginPath();
  context.arc(0, 0, 2 * gap, 0, 2 * Math.PI);
  context.stroke();
  context.clearRect(0, -gap / 2, 3 * gap, gap);
}

function pressed(): Promise<number> {
  return new Promise((resolve) => {
    const heard = (event: KeyboardEvent) => {
      const turn = ARROWS[event.key];
      if (turn === undefined) return;
      window.removeEventListener("keydown", heard);
      resolve(turn);
    };
    window.addEventListener("keydown", heard);
  });
}

/** Show rings until a row is read with less than three right, and return the rows. */
export async function checkAcuity(
  display: HTMLElement,
  distanceMm: number,
  pxPerMm: number,
): Promise<{ distance_mm: number; px_per_mm: number; rows: AcuityRow[] }> {
  await form(display, "Sharpness of sight", [
    make("p", {}, `Sit ${Math.round(distanceMm / 10)} cm from the display.`),
    make(
      "p",
      {},
      "You will see rings with a gap. Press the arrow key that points to where the gap is; guess if you cannot tell.",
    ),
  ]);
  const rows: AcuityRow[] = [];
  for (const logmar of SIZES) {
    const gap = gapPx(logmar, distanceMm, pxPerMm);
    if (gap * window.devicePixelRatio < LEAST_GAP_PX && rows.length > 0) break;
    let right = 0;
    for (let index = 0; index < RINGS; index++) {
      const turn = Math.floor(Math.random() * 4);
      const canvas = make("canvas", {
        class: "ring",
        "data-turn": turn,
        role: "img",
        "aria-label": "ring with a gap",
      });
      ring(canvas, gap, turn);
      display.replaceChildren(make("div", { class: "bright-field" }, canvas));
      if ((await pressed()) === turn) right++;
    }
    rows.push({ logmar, shown: RINGS, right });
    if (right < 3) break;
  }
  return { distance_mm: distanceMm, px_per_mm: pxPerMm, rows };
}
