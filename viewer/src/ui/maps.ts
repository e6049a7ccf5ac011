/** The maps that can be shown, and the range of their colours. */

import { MODES, type Mode } from "../gl/model-shader";
import { residualBasis } from "../gl/residual";
import type { Content, Range } from "../gl/scene";
import type { Column, ModelEntry, ResidualTerm } from "../store/attributes";
import type { PublishedStore } from "../store/published";
import type { Messages } from "./i18n";

export interface Choice {
  readonly value: string;
  readonly label: string;
}

/** Quantities of which each component is its own map would clutter the list; these have their own entries. */
const WITHOUT_OWN_ENTRY = ["normal", "status"];

export function basicChoices(store: PublishedStore, model: ModelEntry, messages: Messages): Choice[] {
  const modes: Mode[] = ["radiance", "specular", "diffuse", "normal", "albedo"];
  if (model.lobes === 0) modes.splice(1, 1);
  if (model.lobes > 0) modes.push("ratio");
  if (model.gloss.some((table) => table.angle_deg === 60 && table.axes.length <= 2)) modes.push("gloss");
  if (model.residual) modes.push("residual");
  const choices = modes.map((mode) => ({ value: mode as string, label: messages[mode] }));
  if (store.heights()) choices.push({ value: "height", label: messages.height });
  return choices;
}

export function columnChoices(model: ModelEntry, of: "parameters" | "quality", messages: Messages): Choice[] {
  return model[of]
    .filter(
      (column) => !WITHOUT_OWN_ENTRY.includes(column.name) || (of === "quality" && column.name === "status"),
    )
    .map((column) => ({
      value: `${of}:${column.name}:${column.component}`,
      label: columnLabel(column, model, of, messages),
    }));
}

export function columnLabel(
  column: Column,
  model: ModelEntry,
  of: "parameters" | "quality",
  messages: Messages,
): string {
  if (column.name === "status") return messages.status;
  const base = column.name.replace(/_sd$/, "");
  let label = messages.quantities[base] ?? base;
  if (column.name.endsWith("_sd")) label = messages.deviation(label);
  const siblings = model[of].filter((other) => other.name === column.name).length;
  if (siblings < 2) return label;
  const component =
    base === "specular" ? messages.lobe(column.component + 1) : messages.components[column.component];
  return `${label}, ${component}`;
}

/** What a choice of the list shows, with the range of its colours; falls back to the painting under the light. */
export function contentOf(
  show: string,
  model: ModelEntry,
  store: PublishedStore,
  range: Range,
  withResidual: boolean,
): Content {
  const lit = (mode: Mode): Content => {
    const residual = withResidual && (mode === "residual" || mode === "radiance");
    return { kind: "model", model, mode, range, residual };
  };
  if (show in MODES) return lit(show as Mode);
  if (show === "height" && store.heights()) return { kind: "column", model, of: "height", column: 0, range };
  const found = findColumn(show, model);
  if (found) return { kind: "column", model, of: found.of, column: found.index, range };
  return lit("radiance");
}

export function findColumn(
  show: string,
  model: ModelEntry,
): { of: "parameters" | "quality"; index: number; column: Column } | null {
  const [of, name, component] = show.split(":");
  if (of !== "parameters" && of !== "quality") return null;
  const index = model[of].findIndex((each) => each.name === name && each.component === Number(component));
  return index < 0 ? null : { of, index, column: model[of][index]! };
}

/** Whether what is shown has a colour bar. */
export function hasLegend(show: string, model: ModelEntry): boolean {
  return ["ratio", "gloss", "height", "residual"].includes(show) || findColumn(show, model) !== null;
}

export function decode(column: Column, code: number): number {
  if (code === 0) return Number.NaN;
  const linear = column.offset + column.scale * code;
  if (column.transfer === "linear") return linear;
  return code === 1 ? 0 : 2 ** linear;
}

/** Pixels whose residual tells the range of colours. */
const SAMPLED = 20_000;
const UNKNOWN: Range = { low: 0, high: 1, scale: "linear" };

/** Returns a range for colours from the coarsest level: the middle 96 per cent, logarithmic where it spans decades. */
export async function findRange(show: string, model: ModelEntry, store: PublishedStore): Promise<Range> {
  if (show === "gloss") return { low: 1, high: 100, scale: "logarithmic" };
  if (show === "quality:status:0") return { low: 0, high: 5, scale: "linear" };
  if (!hasLegend(show, model)) return UNKNOWN;
  if (show === "residual") return residualRange(model, store);
  const values = (await coarseValues(show, model, store)).filter(Number.isFinite).sort((a, b) => a - b);
  if (values.length === 0) return UNKNOWN;
  const at = (share: number) => values[Math.round(share * (values.length - 1))]!;
  const [low, high] = [at(0.02), at(0.98)];
  if (low > 0 && high / low > 30) return { low: Math.max(low, high / 1e5), high, scale: "logarithmic" };
  return { low, high: high > low ? high : low + Math.abs(low) * 0.01 + 1e-6, scale: "linear" };
}

async function coarseValues(show: string, model: ModelEntry, store: PublishedStore): Promise<number[]> {
  const found = findColumn(show, model);
  const heights = show === "height" ? store.heights() : null;
  const layer = heights ?? store.layer(model, found?.of ?? "parameters");
  const level = layer.levels[layer.levels.length - 1]!;
  const codes = await store.chunk(layer, level, 0, 0);
  const columns = layer.columns;
  const count = columns.length;
  const pick = (pixel: number, index: number) => decode(columns[index]!, codes[pixel * count + index]!);
  const pixels = Array.from({ length: codes.length / count }, (_, pixel) => pixel);
  if (show !== "ratio") {
    const index = found?.index ?? 0;
    return pixels.map((pixel) => pick(pixel, index));
  }
  const specular = columns.findIndex((column) => column.name === "specular");
  const diffuse = columns.findIndex((column) => column.name === "diffuse");
  return pixels.map((pixel) => pick(pixel, specular) / pick(pixel, diffuse));
}

/** A range for what the residual term adds, the same for all lights: the 98th percentile over pixels of its root mean square. */
async function residualRange(model: ModelEntry, store: PublishedStore): Promise<Range> {
  const layers = [store.layer(model, "parameters"), store.residual(model)!];
  const level = layers[0]!.levels[layers[0]!.levels.length - 1]!;
  const [codes, packed] = await Promise.all(layers.map((layer) => store.chunk(layer, level, 0, 0)));
  const { components, table, toe } = model.residual!;
  const { parameters } = model;
  const diffuse = parameters.findIndex((column) => column.name === "diffuse");
  const gram = meanProducts(model.residual!);
  const added: number[] = [];
  const count = packed!.length / components;
  for (let pixel = 0; pixel < count; pixel += Math.ceil(count / SAMPLED)) {
    const albedo = decode(parameters[diffuse]!, codes![pixel * parameters.length + diffuse]!);
    if (Number.isNaN(albedo)) continue;
    const coefficient = Array.from(
      packed!.subarray(pixel * components, (pixel + 1) * components),
      (c) => table[c]!,
    );
    let square = 0;
    for (let j = 0; j < components; j++) {
      for (let k = 0; k < components; k++) square += coefficient[j]! * coefficient[k]! * gram[j]![k]!;
    }
    // (√(Y + a) + v)² − (Y + a), to first order in v.
    added.push(2 * Math.sqrt((albedo + toe) * Math.max(square, 0)));
  }
  added.sort((a, b) => a - b);
  const high = (added[Math.round(0.98 * (added.length - 1))] ?? 0) + 1e-4;
  return { low: -high, high, scale: "diverging" };
}

/** Mean over the fitted lights of the products of any two components, in the first channel. */
function meanProducts(term: ResidualTerm): number[][] {
  const bases = term.direction.map((light) => residualBasis(term, light).map((channels) => channels[0]!));
  return Array.from({ length: term.components }, (_, j) =>
    Array.from(
      { length: term.components },
      (_, k) => bases.reduce((sum, basis) => sum + basis[j]! * basis[k]!, 0) / bases.length,
    ),
  );
}
