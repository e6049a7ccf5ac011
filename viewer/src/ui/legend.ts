/** The colour bar of a map: its name, unit and scale. */

import { cssGradient } from "../gl/colour-map";
import type { Range } from "../gl/scene";
import { h } from "./dom";

const TICKS = 5;

export function legend(title: string, units: string, range: Range): HTMLElement {
  const ticks = Array.from({ length: TICKS }, (_, i) => {
    const share = i / (TICKS - 1);
    const value =
      range.scale === "logarithmic"
        ? range.low * (range.high / range.low) ** share
        : range.low + (range.high - range.low) * share;
    return h("span", {}, format(value));
  });
  const bar = h("div", { class: "bar" });
  bar.style.background = cssGradient(range.scale === "diverging");
  const unit = units && units !== "1" ? ` (${units})` : "";
  return h(
    "figure",
    { class: "legend" },
    h("figcaption", {}, `${title}${unit}${range.scale === "logarithmic" ? " · log" : ""}`),
    bar,
    h("div", { class: "ticks" }, ...ticks),
  );
}

/** A number with three digits. */
export function format(value: number): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (value !== 0 && (size < 0.001 || size >= 1e5)) return value.toExponential(1);
  return String(Number(value.toPrecision(3)));
}
