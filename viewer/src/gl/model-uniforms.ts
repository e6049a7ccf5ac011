/** What the program of a model is told about the lights, the camera and the model. */

import type { Attributes, GlossTable, ModelEntry, ResidualTerm } from "../store/attributes";
import { placeLights } from "./light-distance";
import { floatTexture, type Program } from "./program";
import { residualBasis, rgb } from "./residual";
import type { Scene, ShaderLight } from "./scene";

const GLOSS_ANGLE = 60;

/** Texture units; samplers of different kinds must not share one. */
export const UNITS = {
  codes: 0,
  colourMap: 1,
  coarse: 2,
  glossTable: 3,
  residualCodes: 4,
  residualTable: 5,
  residualBasis: 6,
} as const;

export class ModelUniforms {
  readonly #gloss = new Map<string, WebGLTexture>();
  readonly #tables = new Map<string, WebGLTexture>();
  readonly #bases = new Map<string, { lights: string; texture: WebGLTexture }>();

  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly attributes: Attributes,
  ) {}

  dispose(): void {
    const bases = [...this.#bases.values()].map(({ texture }) => texture);
    for (const texture of [...this.#gloss.values(), ...this.#tables.values(), ...bases]) {
      this.gl.deleteTexture(texture);
    }
  }

  /** Sets all that holds for the whole frame. */
  set(program: Program, model: ModelEntry, scene: Scene): void {
    const { gl } = this;
    const lights = placeLights(scene.lights, model, this.attributes);
    const places = lights.flatMap((light) => [...light.place, light.near ? 1 : 0]);
    gl.uniform4fv(program.at("lightPlace"), places);
    gl.uniform3fv(
      program.at("lightColour"),
      lights.flatMap((light) => [...light.colour]),
    );
    program.int("lightCount", lights.length);
    const { view_direction: direction, distance_mm: distance } = this.attributes.camera;
    program.vector("camera", [...direction.map((x) => x * (distance ?? 1)), distance === null ? 0 : 1]);
    program.vector("specularColour", rgb(model.light_rgb));
    program.float("optics.index", model.index_of_refraction);
    program.int("optics.element", model.fresnel === "element" ? 1 : 0);
    const azimuth = ((model.sample?.arm_azimuth_deg ?? 0) * Math.PI) / 180;
    program.vector("armAzimuth", [Math.cos(azimuth), Math.sin(azimuth)]);
    program.float("exaggeration", scene.exaggeration);
    this.#setGloss(program, model);
    if (model.residual) this.#setResidual(program, model.name, model.residual, scene.lights);
  }

  #setGloss(program: Program, model: ModelEntry): void {
    const table = model.gloss.find((each) => each.angle_deg === GLOSS_ANGLE);
    if (!table || table.axes.length > 2) return;
    this.gl.activeTexture(this.gl.TEXTURE0 + UNITS.glossTable); // what is made is bound there
    let texture = this.#gloss.get(model.name);
    if (!texture) {
      texture = this.#glossTexture(model, table);
      this.#gloss.set(model.name, texture);
    }
    this.gl.bindTexture(this.gl.TEXTURE_2D, texture);
    const axis = (i: number) => {
      const { low, high } = table.axes[i] ?? { low: 1, high: Math.E };
      return [Math.log(low), Math.log(high / low)];
    };
    program.vector("glossAxes", [...axis(0), ...axis(1)]);
  }

  #glossTexture(model: ModelEntry, table: GlossTable): WebGLTexture {
    // The second parameter runs fastest in the store, the first along x in the texture.
    const width = table.axes[0]?.count ?? 1;
    const height = table.axes[1]?.count ?? 1;
    const per = 1 + model.lobes;
    const values = new Float32Array(4 * width * height);
    for (let x = 0; x < width; x++) {
      for (let y = 0; y < height; y++) {
        for (let i = 0; i < per; i++) {
          values[4 * (y * width + x) + i] = Math.log(table.values[(x * height + y) * per + i]! + 1e-30);
        }
      }
    }
    return floatTexture(this.gl, width, height, values);
  }

  #setResidual(program: Program, name: string, term: ResidualTerm, lights: readonly ShaderLight[]): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + UNITS.residualTable);
    let table = this.#tables.get(name);
    if (!table) {
      table = floatTexture(gl, 256, 1, new Float32Array(term.table.flatMap((value) => [value, 0, 0, 0])));
      this.#tables.set(name, table);
    }
    gl.bindTexture(gl.TEXTURE_2D, table);
    gl.activeTexture(gl.TEXTURE0 + UNITS.residualBasis);
    const key = lights.map(({ place }) => place.join()).join(";");
    let basis = this.#bases.get(name);
    if (basis?.lights !== key) {
      if (basis) gl.deleteTexture(basis.texture);
      const rows = lights.flatMap(({ place }) => {
        const length = Math.hypot(...place);
        const direction = place.map((value) => value / length);
        return residualBasis(term, direction).flatMap((channels) => [...channels, 0]);
      });
      const texture = floatTexture(gl, term.components, lights.length, new Float32Array(rows));
      basis = { lights: key, texture };
      this.#bases.set(name, basis);
    }
    gl.bindTexture(gl.TEXTURE_2D, basis.texture);
    program.float("toe", term.toe);
  }
}
