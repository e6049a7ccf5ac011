/** A pixel's parameters, and its radiance under a light that moves in the plane of the present one. */

import { evaluateBasis } from "../gl/basis";
import { placeLights, seenFrom } from "../gl/light-distance";
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

/** The light's angle and direction are those from the centre of the painting, radiance is per unit of irradiance. */
interface CurvePoint {
  readonly angle: number;
  readonly light: Vector;
  readonly falloff: number;
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

  /** Radiance over angles of the light, by the shader's own basis, with the light as far away as it is drawn. */
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
    const distant = sweep.map((angle) => ({ place: direction(angle, azimuth), near: false }));
    const place = this.#place(x, y);
    const lights = placeLights(distant, model, this.store.attributes).map((light) => seenFrom(place, light));
    const cases = lights.map(({ direction: light }) => ({ normal, view, shape, light }));
    const optics = { index: model.index_of_refraction, element: model.fresnel === "element" };
    const basis = evaluateBasis(this.gl, given, optics, cases);
    const [diffuse, ambient, tint] = [pick("diffuse"), pick("ambient"), pick("specular_rgb")];
    return basis.map(([d, ...lobes], i) => {
      const highlight = lobes.reduce((sum, lobe, j) => sum + lobe * (specular[j] ?? 0), 0);
      const radiance = model.light_rgb.map(
        (colour, c) => diffuse[c]! * d! + (ambient[c] ?? 0) + colour * (tint[c] ?? 1) * highlight,
      );
      return { angle: sweep[i]!, light: distant[i]!.place, falloff: lights[i]!.falloff, radiance };
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

  /** Where a pixel lies on the painting, in mm; without a scale, in pixels. */
  #place(x: number, y: number): [number, number] {
    const scale = this.store.attributes.camera.mm_per_px ?? 1;
    return [(x - (this.store.width - 1) / 2) * scale, -(y - (this.store.height - 1) / 2) * scale];
  }

  #view(x: number, y: number): Vector {
    const { view_direction, distance_mm, mm_per_px } = this.store.attributes.camera;
    const towards = view_direction as Vector;
    if (distance_mm === null || mm_per_px === null) return towards;
    const place = towards.map((value) => value * distance_mm) as Vector;
    return seenFrom(this.#place(x, y), { place, near: true }).direction;
  }

  /**
   * Angle and luminance of the photographs whose light stands near the plane.
   *
   * A light whose position was stated counts as the pixel sees it, because curves are then of lights far away.
   */
  async measured(x: number, y: number, azimuth: number): Promise<[number, number][]> {
    const place = this.#place(x, y);
    const lights = this.store.attributes.photographs!.lights.map(({ direction, position_mm, intensity }) => {
      const light = { place: (position_mm ?? direction) as Vector, near: position_mm !== null };
      return { intensity, ...seenFrom(place, light) };
    });
    const points: [number, number][] = [];
    const queue = [...lights.keys()].filter(
      (index) => angleInPlane(lights[index]!.direction, azimuth) !== null,
    );
    const work = async () => {
      for (let index = queue.shift(); index !== undefined; index = queue.shift()) {
        const { direction: towards, falloff, intensity } = lights[index]!;
        const layer = this.store.photograph(index);
        const codes = await this.#codes(layer, x, y);
        const values = layer.columns.map((column, i) => decode(column, codes[i]!) / intensity[i]!);
        points.push([angleInPlane(towards, azimuth)!, luminance(values) / falloff]);
      }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, work));
    return points.filter(([, value]) => Number.isFinite(value)).sort(([a], [b]) => a - b);
  }
}

function brightness(curve: readonly CurvePoint[]): [number, number][] {
  return curve.map(({ angle, falloff, radiance }) => [angle, falloff * luminance(radiance)]);
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
