/** WebGL2 programs with their uniforms by name. */

export class Program {
  readonly #locations = new Map<string, WebGLUniformLocation | null>();
  #linked = false;
  readonly handle: WebGLProgram;

  constructor(
    readonly gl: WebGL2RenderingContext,
    vertex: string,
    fragment: string,
  ) {
    const program = gl.createProgram();
    for (const [type, source] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const shader = gl.createShader(type)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      gl.deleteShader(shader);
    }
    gl.linkProgram(program);
    this.handle = program;
  }

  /** Whether it can be used without waiting for its compiler, as far as the browser tells. */
  get ready(): boolean {
    const parallel = this.gl.getExtension("KHR_parallel_shader_compile");
    if (this.#linked || !parallel) return true;
    return this.gl.getProgramParameter(this.handle, parallel.COMPLETION_STATUS_KHR) as boolean;
  }

  use(): void {
    const { gl, handle } = this;
    if (!this.#linked && !gl.getProgramParameter(handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      const shaders = gl.getAttachedShaders(handle) ?? [];
      const log = shaders.map((shader) => gl.getShaderInfoLog(shader)).join("\n");
      throw new Error(`the shader does not compile: ${gl.getProgramInfoLog(handle)}\n${log}`);
    }
    this.#linked = true;
    gl.useProgram(handle);
  }

  /** Where a uniform lies; null where the program does not use it, which WebGL takes in silence. */
  at(name: string): WebGLUniformLocation | null {
    let location = this.#locations.get(name);
    if (location === undefined) {
      location = this.gl.getUniformLocation(this.handle, name);
      this.#locations.set(name, location);
    }
    return location;
  }

  int(name: string, value: number): void {
    this.gl.uniform1i(this.at(name), value);
  }
  float(name: string, value: number): void {
    this.gl.uniform1f(this.at(name), value);
  }
  vector(name: string, values: readonly number[] | Float32Array): void {
    const location = this.at(name);
    if (values.length === 2) this.gl.uniform2fv(location, values);
    else if (values.length === 3) this.gl.uniform3fv(location, values);
    else this.gl.uniform4fv(location, values);
  }
}

/** A texture of floats that texelFetch reads; `values` has four per texel. */
export function floatTexture(
  gl: WebGL2RenderingContext,
  width: number,
  height: number,
  values: Float32Array,
): WebGLTexture {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, values);
  nearest(gl);
  return texture;
}

/** Sets the bound texture to be read pixel by pixel. */
export function nearest(gl: WebGL2RenderingContext): void {
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.NEAREST],
    [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ] as const) {
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
}
