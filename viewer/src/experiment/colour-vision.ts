// Plates in the manner of Ishihara: a number of dots among dots, which differ in one kind of cone only.
// They find observers who should be tested properly; on an uncalibrated display they diagnose nobody.

import { make } from "./dom";
import { field, form, value } from "./form";

export type Axis = "control" | "protan" | "deutan" | "tritan";

export interface Plate {
  axis: Axis;
  shown: string;
  read: string;
}

type Triple = [number, number, number];

// Linear sRGB to the excitation of long, middle and short cones: Hunt-Pointer-Estevez on CIE XYZ, scaled to 1
// for white. Its inverse is computed below.
const TO_LMS: [Triple, Triple, Triple] = [
  [0.31399, 0.63951, 0.0465],
  [0.15537, 0.75789, 0.08674],
  [0.01775, 0.10944, 0.87281],
];

/** Return the inverse of a 3 × 3 matrix. */
export function inverse(m: readonly Triple[]): Triple[] {
  const [[a, b, c], [d, e, f], [g, h, i]] = m as [Triple, Triple, Triple];
  const det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return [
    [e * i - f * h, c * h - b * i, b * f - c * e],
    [f * g - d * i, a * i - c * g, c * d - a * f],
    [d * h - e * g, b * g - a * h, a * e - b * d],
  ].map((row) => row.map((value) => value / det) as Triple);
}

const FROM_LMS = inverse(TO_LMS);
const CONE: Record<Exclude<Axis, "control">, number> = { protan: 0, deutan: 1, tritan: 2 };
/** Change of the cone's excitation between number and ground; what is left of sRGB's gamut allows no more. */
const CONTRAST: Record<Exclude<Axis, "control">, number> = { protan: 0.12, deutan: 0.14, tritan: 0.6 };
const BASE = 0.35; // relative luminance
const DOTS = 2600;

function encoded(linear: number): number {
  const v = Math.min(1, Math.max(0, linear));
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
}

/** Return the colour of a dot: `side` is 1 in the number and -1 in the ground, `light` scales it. */
export function dotColour(axis: Axis, side: number, light: number): Triple {
  if (axis === "control") {
    const level = BASE * light * (side > 0 ? 1.6 : 0.5);
    return [encoded(level), encoded(level), encoded(level * (side > 0 ? 0.4 : 1))];
  }
  const lms: Triple = [BASE, BASE, BASE];
  lms[CONE[axis]] = BASE * (1 + (side * CONTRAST[axis]) / 2);
  return FROM_LMS.map((row) =>
    encoded(light * (row[0] * lms[0] + row[1] * lms[1] + row[2] * lms[2])),
  ) as Triple;
}

function draw(canvas: HTMLCanvasElement, axis: Axis, digits: string): void {
  const side = canvas.width;
  const mask = make("canvas", { width: side, height: side }).getContext("2d", { willReadFrequently: true })!;
  mask.font = `bold ${side * 0.62}px sans-serif`;
  mask.textAlign = "center";
  mask.textBaseline = "middle";
  mask.fillText(digits, side / 2, side * 0.53, side * 0.8);
  const inside = mask.getImageData(0, 0, side, side).data;
  const context = canvas.getContext("2d")!;
  const dots: [number, number, number][] = [];
  for (let attempt = 0; attempt < DOTS * 6 && dots.length < DOTS; attempt++) {
    const radius = side * (0.008 + 0.014 * Math.random());
    const angle = 2 * Math.PI * Math.random();
    const far = (side / 2 - radius) * Math.sqrt(Math.random());
    const x = side / 2 + far * Math.cos(angle);
    const y = side / 2 + far * Math.sin(angle);
    if (dots.some(([u, v, r]) => Math.hypot(u - x, v - y) < r + radius + 0.5)) continue;
    dots.push([x, y, radius]);
    const number = (inside[4 * (Math.floor(y) * side + Math.floor(x)) + 3] ?? 0) > 127;
    // Brightness varies from dot to dot, so that it cannot tell the number.
    const [red, green, blue] = dotColour(
      axis,
      number ? 1 : -1,
      axis === "control" ? 1 : 0.6 + 0.8 * Math.random(),
    );
    context.fillStyle = `rgb(${red} ${green} ${blue})`;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fill();
  }
}

/** Show the plates one by one, and return what was read. */
export async function checkColourVision(display: HTMLElement): Promise<{ plates: Plate[] }> {
  const plates: Plate[] = [];
  for (const axis of ["control", "protan", "deutan", "tritan"] as const) {
    const shown = String(10 + Math.floor(Math.random() * 89));
    const canvas = make("canvas", { width: 420, height: 420, "data-shown": shown, class: "plate" });
    draw(canvas, axis, shown);
    const filled = await form(display, "Which number do you see?", [
      canvas,
      field("Number; leave it empty if you see none", {
        name: "read",
        inputmode: "numeric",
        pattern: "\\d{1,2}",
        autocomplete: "off",
        maxlength: 2,
      }),
    ]);
    plates.push({ axis, shown, read: value(filled, "read") });
  }
  return { plates };
}
