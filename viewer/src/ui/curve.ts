/** A plot of radiance against the angle of the light: lines of models, points of photographs. */

import { h, svg } from "./dom";
import { format } from "./legend";

export interface Line {
  readonly label: string;
  readonly points: readonly (readonly [number, number])[];
  readonly dots: boolean;
}

const WIDTH = 300;
const HEIGHT = 170;
const LEFT = 40;
const BOTTOM = 28;
const TOP = 8;
const SPAN = 90;

export function curvePlot(
  lines: readonly Line[],
  title: string,
  xLabel: string,
  yLabel: string,
): HTMLElement {
  const highest = Math.max(
    ...lines.flatMap((line) => line.points.map(([, y]) => y)).filter(Number.isFinite),
    1e-6,
  );
  const x = (angle: number) => LEFT + ((angle + SPAN) / (2 * SPAN)) * (WIDTH - LEFT - 6);
  const y = (value: number) => HEIGHT - BOTTOM - (value / highest) * (HEIGHT - BOTTOM - TOP);
  const drawing = svg("svg", {
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
    role: "img",
    "aria-label": title,
    class: "curve",
  });
  for (const angle of [-90, -45, 0, 45, 90]) {
    drawing.append(
      svg("line", { x1: x(angle), x2: x(angle), y1: TOP, y2: HEIGHT - BOTTOM, class: "grid" }),
      svg("text", { x: x(angle), y: HEIGHT - BOTTOM + 11, class: "tick middle" }, String(angle)),
    );
  }
  for (const share of [0, 0.5, 1]) {
    const at = y(share * highest);
    drawing.append(
      svg("line", { x1: LEFT, x2: WIDTH - 6, y1: at, y2: at, class: "grid" }),
      svg("text", { x: LEFT - 4, y: at + 3, class: "tick end" }, format(share * highest)),
    );
  }
  lines.forEach((line, number) => {
    const points = line.points.filter(([, value]) => Number.isFinite(value));
    if (line.dots) {
      drawing.append(
        ...points.map(([a, v]) => svg("circle", { cx: x(a), cy: y(v), r: 2.5, class: "measured" })),
      );
    } else {
      const path = points
        .map(([a, v], i) => `${i ? "L" : "M"}${x(a).toFixed(1)} ${y(v).toFixed(1)}`)
        .join("");
      drawing.append(svg("path", { d: path, class: `line-${number}` }));
    }
  });
  drawing.append(svg("text", { x: (LEFT + WIDTH) / 2, y: HEIGHT - 4, class: "tick middle" }, xLabel));
  const key = lines.map((line, number) =>
    h("li", { class: line.dots ? "key-measured" : `key-${number}` }, line.label),
  );
  return h(
    "figure",
    { class: "plot" },
    h("figcaption", {}, yLabel),
    drawing,
    h("ul", { class: "keys" }, ...key),
  );
}
