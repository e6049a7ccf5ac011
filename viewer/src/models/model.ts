/**
 * A reflectance model as the shader evaluates it, the same as a file of core/src/models.
 *
 * `glsl` defines `Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics)`.
 */
export interface Model {
  /** As the core's list names it. */
  readonly name: string;
  /** Names of the shape parameters, in the core's order. */
  readonly shape: readonly string[];
  readonly lobes: number;
  readonly glsl: string;
}
