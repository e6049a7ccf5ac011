/** A pixel's parameters, and its radiance under a light that moves in the plane of the present one. */

import { evaluateBasis } from "../gl/basis";
import { residualBasis, withResidual } from "../gl/residual";
import { findModel } from "../models";
import type { ModelEntry } from "../store/attributes";
import type { Codes, Layer, PublishedStore } from "../store/published";
import { curvePlot, type Line } from "./curve";
import { h } from "./dom";
import type { Messages } from "./i18n";
import { format } from "./legend";
import { angles, direction, type Vector } from "./lights";
import { columnLabel, decode } from "./maps";

/** How far out of the plane of the curve a photograph's light may stand. */
const PLANE_DEG = 10;
const STEP_DEG = 1;
const AT_ONCE = 6;

export interface PixelValue {
  readonly name: string;
  readonly label: string;
  readonly component: number;
  readonly value: number;
  readonly units: string;
}

interface CurvePoint {
  readonly angle: number;
  readonly light: Vector;
  readonly radiance: readonly number[];
}

export class Inspector {
  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly store: PublishedStore,
    readonly messages: Messages,
  ) {}

  /** Values of a pixel, NaN where there is none. */
  async values(model: ModelEntry, of: "parameters" | "quality", x: number, y: number): Promise<PixelValue[]> {
    const layer = this.store.layer(model, of);
    const codes = await this.#codes(layer, x, y);
    return layer.columns.map((column, i) => ({
      name: column.name,
      label:
        column.name === "normal"
          ? `${this.messages.quantities.normal}, ${"xy"[column.component]}`
          : columnLabel(column, model, of, this.messages),
      component: column.component,
      value: decode(column, codes[i]!),
      units: column.units,
    }));
  }

  async #codes(layer: Layer, x: number, y: number): Promise<Codes> {
    const { chunk, depth } = layer;
    const codes = await this.store.chunk(layer, 0, Math.floor(y / chunk), Math.floor(x / chunk));
    const at = ((y % chunk) * chunk + (x % chunk)) * depth;
    return codes.slice(at, at + depth);
  }

  /** The panel for a pixel; `models` are those shown, `azimuth` the plane of the light. */
  async panel(models: readonly ModelEntry[], x: number, y: number, azimuth: number): Promise<HTMLElement> {
    const { messages } = this;
    const lines: Line[] = [];
    const tables: HTMLElement[] = [];
    for (const model of models) {
      const parameters = await this.values(model, "parameters", x, y);
      const quality = await this.values(model, "quality", x, y);
      const curve = this.#curve(model, parameters, x, y, azimuth);
      lines.push({ label: model.title, points: brightness(curve), dots: false });
      const added = await this.#withResidual(model, curve, x, y);
      if (added)
        lines.push({ label: messages.withResidual(model.title), points: brightness(added), dots: false });
      tables.push(this.#table(model, parameters, quality));
    }
    const plot = h("div");
    const draw = () =>
      plot.replaceChildren(curvePlot(lines, messages.curve, messages.curveAngle, messages.curveRadiance));
    draw();
    const body = h("div", { class: "pixel" }, h("h3", {}, messages.pixel(x, y)), plot);
    const photographs = this.store.attributes.photographs;
    if (photographs) {
      const note = h("p", { role: "status" });
      const button = h(
        "button",
        {
          type: "button",
          onclick: async () => {
            button.disabled = true;
            note.textContent = messages.loading;
            try {
              const points = await this.measured(x, y, azimuth);
              lines.push({ label: messages.compareMeasured, points, dots: true });
              draw();
              note.textContent = messages.measuredPoints(points.length, photographs.lights.length);
            } catch (error) {
              note.textContent = (error as Error).message;
              button.disabled = false;
            }
          },
        },
        messages.readPhotographs(photographs.lights.length),
      );
      body.append(button, note);
    }
    body.append(...tables);
    return body;
  }

  #table(model: ModelEntry, parameters: PixelValue[], quality: PixelValue[]): HTMLElement {
    const rows = [...parameters, ...quality].map(({ name, label, value, units }) => {
      const text = name === "status" ? (model.status_meaning[String(value)] ?? format(value)) : format(value);
      const unit = units === "1" || !Number.isFinite(value) ? "" : ` ${units}`;
      return h("tr", {}, h("th", { scope: "row" }, label), h("td", {}, text + unit));
    });
    return h("table", {}, h("caption", {}, model.title), h("tbody", {}, ...rows));
  }

  /** Radiance over angles of the light, by the shader's own basis. */
  #curve(model: ModelEntry, values: PixelValue[], x: number, y: number, azimuth: number): CurvePoint[] {
    const pick = (name: string) => values.filter((value) => value.name === name).map((value) => value.value);
    const [nx, ny] = pick("normal") as [number, number];
    if (!Number.isFinite(nx + ny)) return [];
    const normal = [nx, ny, Math.sqrt(Math.max(1 - nx * nx - ny * ny, 0))];
    const given = findModel(model.base)!;
    let shape = given.shape.map((name) => pick(name)[0]!);
    let specular = pick("specular");
    if (!specular.every(Number.isFinite) || !shape.every(Number.isFinite)) {
      specular = specular.map(() => 0);
      shape = shape.map(() => 1);
    }
    const view = this.#view(x, y);
    const sweep: number[] = [];
    for (let angle = -89; angle <= 89; angle += STEP_DEG) sweep.push(angle);
    const cases = sweep.map((angle) => ({ normal, view, shape, light: direction(angle, azimuth) }));
    const optics = { index: model.index_of_refraction, element: model.fresnel === "element" };
    const basis = evaluateBasis(this.gl, given, optics, cases);
    const [diffuse, ambient, tint] = [pick("diffuse"), pick("ambient"), pick("specular_rgb")];
    return basis.map(([d, ...lobes], i) => {
      const highlight = lobes.reduce((sum, lobe, j) => sum + lobe * (specular[j] ?? 0), 0);
      const radiance = model.light_rgb.map(
        (colour, c) => diffuse[c]! * d! + (ambient[c] ?? 0) + colour * (tint[c] ?? 1) * highlight,
      );
      return { angle: sweep[i]!, light: cases[i]!.light, radiance };
    });
  }

  /** The same with what the model leaves over, null where the store does not have that. */
  async #withResidual(
    model: ModelEntry,
    curve: CurvePoint[],
    x: number,
    y: number,
  ): Promise<CurvePoint[] | null> {
    const layer = this.store.residual(model);
    if (!layer) return null;
    const { table, toe } = model.residual!;
    const coefficients = Array.from(await this.#codes(layer, x, y), (code) => table[code]!);
    return curve.map((point) => {
      const basis = residualBasis(model.residual!, point.light);
      const radiance = point.radiance.map((value, c) => {
        const added = coefficients.reduce((sum, coefficient, k) => sum + coefficient * basis[k]![c]!, 0);
        return withResidual(value, added, toe);
      });
      return { ...point, radiance };
    });
  }

  #view(x: number, y: number): Vector {
    const { view_direction, distance_mm, mm_per_px } = this.store.attributes.camera;
    if (distance_mm === null || mm_per_px === null) return view_direction as Vector;
    const place = [
      (x - (this.store.width - 1) / 2) * mm_per_px,
      -(y - (this.store.height - 1) / 2) * mm_per_px,
      0,
    ];
    const offset = view_direction.map((value, i) => value * distance_mm - place[i]!);
    const length = Math.hypot(...offset);
    return offset.map((value) => value / length) as Vector;
  }

  /** Angle and luminance of the photographs whose light stands near the plane, per unit of irradiance. */
  async measured(x: number, y: number, azimuth: number): Promise<[number, number][]> {
    const lights = this.store.attributes.photographs!.lights;
    const points: [number, number][] = [];
    const queue = [...lights.keys()].filter(
      (index) => angleInPlane(lights[index]!.direction, azimuth) !== null,
    );
    const work = async () => {
      for (let index = queue.shift(); index !== undefined; index = queue.shift()) {
        const light = lights[index]!;
        const layer = this.store.photograph(index);
        const codes = await this.#codes(layer, x, y);
        const values = layer.columns.map((column, i) => decode(column, codes[i]!) / light.intensity[i]!);
        points.push([angleInPlane(light.direction, azimuth)!, luminance(values)]);
      }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, work));
    return points.filter(([, value]) => Number.isFinite(value)).sort(([a], [b]) => a - b);
  }
}

function brightness(curve: readonly CurvePoint[]): [number, number][] {
  return curve.map(({ angle, radiance }) => [angle, luminance(radiance)]);
}

/** The signed angle of a light in the plane of an azimuth, null where it stands too far out of it. */
export function angleInPlane(light: readonly number[], azimuth: number): number | null {
  const plane = (azimuth * Math.PI) / 180;
  const along = light[0]! * Math.cos(plane) + light[1]! * Math.sin(plane);
  const across = -light[0]! * Math.sin(plane) + light[1]! * Math.cos(plane);
  const degrees = 180 / Math.PI;
  if (Math.abs(Math.asin(Math.min(Math.max(across, -1), 1))) * degrees > PLANE_DEG) return null;
  return Math.sign(along || 1) * angles(light).zenith;
}

export function luminance(values: readonly number[]): number {
  return values.length === 3 ? 0.2126 * values[0]! + 0.7152 * values[1]! + 0.0722 * values[2]! : values[0]!;
}
