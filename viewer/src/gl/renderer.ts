/** Draws a scene from tiles: at every place the finest that is there. */

import { findModel } from "../models";
import type { Attributes, Column } from "../store/attributes";
import type { PublishedStore } from "../store/published";
import { colourMaps } from "./colour-map";
import { modelFragment } from "./model-shader";
import { ModelUniforms, UNITS } from "./model-uniforms";
import { neededBy, type Pane, panesOf, residualOf } from "./panes";
import { nearest, Program } from "./program";
import type { Content, Range, Scene } from "./scene";
import { COLUMN_FRAGMENT, TILE_VERTEX } from "./shaders";
import { bytesOf, type Tile, type TileKey, Tiles } from "./tiles";

/** How many levels coarser the normals are that others are compared with. */
const BLUR_LEVELS = 3;
const SCALES: Record<Range["scale"], number> = { linear: 0, logarithmic: 1, diverging: 2 };
const POLL_MS = 5;

export class Renderer {
  readonly gl: WebGL2RenderingContext;
  readonly tiles: Tiles;
  readonly #programs = new Map<string, Program>();
  readonly #uniforms: ModelUniforms;
  readonly #colours: WebGLTexture;
  readonly #attributes: Attributes;
  #compiling = false;
  #drawn = 0;
  #begun = false;

  constructor(
    gl: WebGL2RenderingContext,
    readonly store: PublishedStore,
    memory: number,
  ) {
    this.gl = gl;
    this.tiles = new Tiles(gl, store, memory);
    this.#attributes = store.attributes;
    this.#uniforms = new ModelUniforms(gl, store.attributes);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.#colours = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.#colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 2, 0, gl.RGBA, gl.UNSIGNED_BYTE, colourMaps());
    nearest(gl);
  }

  /** Whether the last frame lacks something because its program is still being compiled. */
  get compiling(): boolean {
    return this.#compiling;
  }

  /** How many tiles the last frame shows. */
  get drawn(): number {
    return this.#drawn;
  }

  dispose(): void {
    this.tiles.dispose();
    this.#uniforms.dispose();
    this.gl.deleteTexture(this.#colours);
    for (const program of this.#programs.values()) this.gl.deleteProgram(program.handle);
  }

  /**
   * Draws what is there and asks for what is not; returns whether the frame is complete.
   *
   * @param wait - whether to wait for compilers, rather than leave out what they are not done with
   */
  draw(scene: Scene, wait = false): boolean {
    const { gl, tiles, store } = this;
    tiles.begin();
    this.#compiling = false;
    this.#drawn = 0;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.SCISSOR_TEST);
    const panes = panesOf(scene, store, gl.drawingBufferWidth, gl.drawingBufferHeight);
    const needed = panes.map((pane) => neededBy(pane, scene.view, store, tiles.limit, panes.length));
    // Programs are compiled while tiles are on their way.
    for (const pane of panes) this.#programOf(pane, scene);
    const coarsest = needed.flatMap((each) => each.coarsest);
    this.#begun ||= coarsest.some((key) => tiles.get(key));
    const kinds = scene.still ? (["visible", "around"] as const) : (["visible"] as const);
    const rest = kinds.flatMap((kind) => needed.flatMap((each) => each[kind]));
    // The first picture waits for nothing else.
    this.#ask(this.#begun ? [...coarsest, ...rest] : coarsest);
    let complete = true;
    panes.forEach((pane, i) => {
      const [from, to] = pane.clip;
      gl.scissor(from, 0, to - from, gl.drawingBufferHeight);
      complete = this.#drawPane(pane, scene, needed[i]!.visible, wait) && complete;
    });
    return complete;
  }

  /** Waits until the graphics card has drawn all that it was told to. */
  async finished(): Promise<void> {
    const { gl } = this;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    if (!fence) return; // the context is lost
    while (gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) {
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
    gl.deleteSync(fence);
  }

  /** Asks for as many tiles as fit at once, or they would push each other out for ever. */
  #ask(keys: TileKey[]): void {
    let room = this.tiles.limit;
    const fitting = keys.filter((key) => {
      room -= bytesOf(key.layer);
      return room >= 0;
    });
    for (const key of fitting) this.tiles.get(key);
    this.tiles.want(fitting);
  }

  #drawPane(pane: Pane, scene: Scene, visible: TileKey[], wait: boolean): boolean {
    const program = this.#usable(pane, scene, wait);
    const finest = visible[0]?.level ?? 0;
    const complete = visible.every((key) => this.tiles.get(key) !== undefined);
    if (!program) {
      this.#compiling = true;
      return false;
    }
    this.#prepare(program, pane, scene);
    const places = visible.filter((key) => key.layer === pane.layer);
    const there = places.map((key) => this.tiles.get(key));
    if (there.includes(undefined)) {
      const between: Tile[] = [];
      for (const key of places) {
        for (let level = finest + 1; level <= pane.layer.levels[pane.layer.levels.length - 1]!; level++) {
          const up = level - finest;
          const tile = this.tiles.get({ ...key, level, row: key.row >> up, column: key.column >> up });
          if (tile && !between.includes(tile)) between.push(tile);
        }
      }
      between.sort((a, b) => b.level - a.level);
      for (const tile of between) this.#drawTile(program, pane, scene, tile);
    }
    for (const tile of there) if (tile) this.#drawTile(program, pane, scene, tile);
    return complete;
  }

  /** The program of a pane if it is ready; where only the one that blends pixels is not, the other. */
  #usable(pane: Pane, scene: Scene, wait: boolean): Program | null {
    const program = this.#programOf(pane, scene);
    if (wait || program.ready) return program;
    const plain = scene.smooth ? this.#programOf(pane, { ...scene, smooth: false }) : program;
    if (!plain.ready) return null;
    this.#compiling = true;
    return plain;
  }

  #programOf({ content, residual }: Pane, { smooth, exaggeration }: Scene): Program {
    if (content.kind !== "model") return this.#program("column", () => COLUMN_FRAGMENT);
    const { model, mode } = content;
    const variant = { mode, smooth, exaggerated: exaggeration > 0, components: residual?.depth ?? 0 };
    return this.#program(`${model.name} ${Object.values(variant)}`, () =>
      modelFragment(findModel(model.base)!, model.parameters, this.#attributes.light_rgb.length, variant),
    );
  }

  #program(name: string, fragment: () => string): Program {
    let program = this.#programs.get(name);
    if (!program) {
      program = new Program(this.gl, TILE_VERTEX, fragment());
      this.#programs.set(name, program);
    }
    return program;
  }

  #prepare(program: Program, { content, layer }: Pane, scene: Scene): void {
    program.use();
    const coding = layer.columns.flatMap((column: Column) => [
      column.offset,
      column.scale,
      column.transfer === "log" ? 1 : 0,
    ]);
    this.gl.uniform3fv(program.at("coding"), coding);
    this.#prepareDisplay(program, scene);
    this.#prepareContent(program, content);
    if (content.kind === "model") this.#uniforms.set(program, content.model, scene);
  }

  #prepareContent(program: Program, content: Content): void {
    if (content.kind === "photograph") {
      program.int("column", 0);
      program.int("channels", this.#attributes.light_rgb.length);
      return;
    }
    const { low, high, scale } = content.range;
    program.vector("range", [low, high, SCALES[scale]]);
    if (content.kind === "column") {
      program.int("column", content.column);
      program.int("channels", 0);
    }
  }

  #prepareDisplay(program: Program, scene: Scene): void {
    const { gl } = this;
    const rows = this.#attributes.display.matrix;
    const columns = (start: number) => [0, 1, 2].flatMap((j) => rows.map((row) => row[start + j] ?? 0));
    gl.uniformMatrix3fv(program.at("toDisplay"), false, columns(0));
    gl.uniformMatrix3fv(program.at("toDisplayRoots"), false, columns(3));
    program.float("exposure", scene.exposure);
    for (const [name, unit] of Object.entries(UNITS)) program.int(name, unit);
    this.#bind(UNITS.colourMap, this.#colours);
  }

  #bind(unit: number, texture: WebGLTexture): void {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, texture);
  }

  #drawTile(program: Program, pane: Pane, scene: Scene, tile: Tile): void {
    const { gl } = this;
    const { view } = scene;
    const size = 2 ** tile.level;
    const chunk = tile.layer.chunk;
    const height = gl.drawingBufferHeight;
    // The last pixels of a level may stand for fewer of the picture's than the others.
    const right = Math.min((tile.column * chunk + tile.width) * size, this.store.width);
    const bottom = Math.min((tile.row * chunk + tile.height) * size, this.store.height);
    const left = tile.column * chunk * size;
    const top = tile.row * chunk * size;
    gl.viewport(pane.left, 0, pane.width, height);
    const x = (px: number) => ((px - view.x) * view.scale * 2) / pane.width;
    const y = (px: number) => (-(px - view.y) * view.scale * 2) / height;
    program.vector("place", [x(left), y(top), x(right), y(bottom)]);
    program.vector("part", [0, 0, (right - left) / size, (bottom - top) / size]);
    program.int("blocks", tile.blocks);
    gl.uniform2i(program.at("last"), tile.width - 1, tile.height - 1);
    const mm = this.#attributes.camera.mm_per_px ?? 1; // lengths are in pixels where nothing is known
    program.vector("position", [
      (left + (size - 1) / 2 - (this.store.width - 1) / 2) * mm,
      -(top + (size - 1) / 2 - (this.store.height - 1) / 2) * mm,
      size * mm,
      -size * mm,
    ]);
    const around = scene.exaggeration > 0 && pane.content.kind === "model" ? this.#around(tile) : tile;
    const factor = 2 ** (tile.level - around.level);
    program.vector("coarsePlace", [
      factor,
      left / 2 ** around.level - around.column * chunk,
      top / 2 ** around.level - around.row * chunk,
      (around.width - 1) | ((around.height - 1) << 10),
    ]);
    const [residual] = residualOf(pane, [tile]).map((key) => this.tiles.get(key));
    program.int("residualBlocks", residual?.blocks ?? 0);
    this.#bind(UNITS.residualCodes, (residual ?? tile).texture);
    this.#bind(UNITS.coarse, around.texture);
    this.#bind(UNITS.codes, tile.texture);
    this.#drawn++;
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /** A coarser tile over the same place, the tile itself where there is none. */
  #around(tile: Tile): Tile {
    for (let up = BLUR_LEVELS; up > 0; up--) {
      const key = { ...tile, level: tile.level + up, row: tile.row >> up, column: tile.column >> up };
      const coarser = this.tiles.get(key);
      if (coarser) return coarser;
    }
    return tile;
  }
}
