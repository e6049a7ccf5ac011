/**
 * The element `<impasto-viewer src="…/painting.zarr">`; docs/publish.md lists its attributes and events.
 */

import type { ImpastoViewerEvents } from "./events";
import { type BasisCase, type BasisOptics, evaluateBasis } from "./gl/basis";
import { Renderer } from "./gl/renderer";
import type { Scene, View } from "./gl/scene";
import { findModel, MODELS, type Model } from "./models";
import { asProblem, type StoreProblem } from "./store/errors";
import { PublishedStore } from "./store/published";
import { copyAddress } from "./ui/address";
import { Annotations } from "./ui/annotations";
import { download } from "./ui/dom";
import { attachGestures, type GestureTarget } from "./ui/gestures";
import { fromPlace, ontoArm } from "./ui/hemisphere";
import { messagesFor } from "./ui/i18n";
import { Inspector } from "./ui/inspector";
import { type KeyTarget, pressed } from "./ui/keys";
import { Layout } from "./ui/layout";
import { Milestones } from "./ui/milestones";
import { NotesPanel } from "./ui/notes-panel";
import type { Rule } from "./ui/overlay";
import { Panel, type Tool } from "./ui/panel";
import { Scenes } from "./ui/scenes";
import { saved } from "./ui/snapshot";
import { fromHash, initialState, type Light, type State, toHash } from "./ui/state";
import { fitted, panned, toPage, toPicture, type Viewport, zoomed } from "./ui/viewport";
import css from "./viewer.css?inline";

export type { ImpastoViewerEvents } from "./events";
export type { Light, State } from "./ui/state";

const sheet = new CSSStyleSheet();
sheet.replaceSync(css);

const MEGABYTE = 1 << 20;
/** Enough tiles for a window of 1440 x 900 pixels, without and with a residual term. */
const DEFAULT_CACHE_MB = { plain: 112, residual: 240 };
const SETTLED_MS = 160;
/** How long to leave a compiler alone: before there is anything to see, and after. */
const COMPILE_MS = { nothing: 8, something: 100 };

/** Everything that there is once a store is open. */
interface Opened {
  readonly store: PublishedStore;
  readonly scenes: Scenes;
  readonly inspector: Inspector;
  readonly panel: Panel;
  readonly notes: NotesPanel;
  renderer: Renderer;
}

export class ImpastoViewer extends HTMLElement implements GestureTarget, KeyTarget {
  static readonly observedAttributes = ["src", "lang", "cache-mb"];

  readonly #root = this.attachShadow({ mode: "open" });
  #layout = new Layout(messagesFor([]), this);
  #opened: Opened | null = null;
  #state: State = initialState("");
  #given = ""; // a state asked for before the store was there
  #tool: Tool = "inspect";
  #rule: Rule | null = null;
  #draggingLight = false;
  #opening: AbortController | null = null;
  #frame = 0;
  #changed = 0;
  #milestones = new Milestones();
  #resize = new ResizeObserver(() => this.#fitCanvas());

  /** What is shown; set it to change that. */
  get state(): State {
    return this.#state;
  }
  set state(state: State) {
    this.#change(state);
  }

  /** The state as the part of an address behind `#`. */
  get hash(): string {
    return toHash(this.#state);
  }
  set hash(hash: string) {
    if (this.#opened) this.#change(this.#opened.scenes.known(fromHash(hash, { ...this.#state, view: null })));
    else this.#given = hash;
  }

  /** Whether all tiles of the present view are drawn. */
  get complete(): boolean {
    const renderer = this.#opened?.renderer;
    return (
      this.#milestones.whole && this.#frame === 0 && !renderer?.compiling && renderer?.tiles.pending === 0
    );
  }

  get store(): PublishedStore | null {
    return this.#opened?.store ?? null;
  }

  /** The models that the shader knows. */
  get models(): readonly Model[] {
    return MODELS;
  }

  /** Basis values of a model as the graphics card computes them: diffuse, and one per lobe, for each case. */
  basis(model: string, optics: BasisOptics, cases: readonly BasisCase[]): number[][] {
    const found = findModel(model);
    if (!found || !this.#opened) throw new Error(`no model ${model}, or no store yet`);
    return evaluateBasis(this.#opened.renderer.gl, found, optics, cases);
  }

  /** Bytes of tiles on the graphics card. */
  get cacheBytes(): number {
    return this.#opened?.renderer.tiles.bytes ?? 0;
  }

  connectedCallback(): void {
    this.#root.adoptedStyleSheets = [sheet];
    void this.#open();
  }

  disconnectedCallback(): void {
    this.#close();
  }

  attributeChangedCallback(): void {
    if (this.isConnected && this.#root.childNodes.length) void this.#open();
  }

  #close(): void {
    this.#opening?.abort();
    this.#resize.disconnect();
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.#opened?.renderer.dispose();
    this.#opened = null;
    this.#milestones = new Milestones();
  }

  async #open(): Promise<void> {
    this.#close();
    const messages = messagesFor([this.lang || document.documentElement.lang, ...navigator.languages]);
    this.#layout = new Layout(messages, this);
    this.#root.replaceChildren(this.#layout.frame);
    this.#layout.showSide(!this.hasAttribute("closed"));
    this.#resize.observe(this.#layout.stage);
    this.#resize.observe(this);
    attachGestures(this.#layout.canvas, this);
    const src = this.getAttribute("src");
    if (!src) return;
    this.#opening = new AbortController();
    const { signal } = this.#opening;
    try {
      const opening = PublishedStore.open(new URL(src, document.baseURI), signal);
      opening.catch(() => {}); // told below
      // While the store's metadata are on their way the graphics card wakes up.
      await new Promise((resolve) => setTimeout(resolve));
      const gl = this.#layout.context();
      const store = await opening;
      if (!signal.aborted) this.#begin(store, gl);
    } catch (error) {
      if (signal.aborted) return;
      this.#layout.fail(this.#layout.problems.words(asProblem(error, src)), () => void this.#open());
    }
  }

  #begin(store: PublishedStore, gl: WebGL2RenderingContext | null): void {
    const { messages, canvas } = this.#layout;
    const [model] = store.attributes.models;
    if (!model || !gl) {
      this.#layout.fail(model ? messages.noWebgl : messages.noModels);
      return;
    }
    const redraw = () => {
      this.#drawOverlay();
      this.#draw();
    };
    const scenes = new Scenes(store, redraw, (problem) => this.#report(problem));
    const notes = new NotesPanel(messages, new Annotations(store.http.url.href), {
      hash: () => this.hash,
      show: (hash) => {
        this.hash = hash;
      },
      change: () => this.#drawOverlay(),
    });
    const panel = this.#newPanel(store);
    const inspector = new Inspector(gl, store, messages);
    const renderer = this.#newRenderer(gl, store);
    this.#opened = { store, scenes, inspector, panel, notes, renderer };
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.#layout.problems.say(messages.lostContext);
    });
    canvas.addEventListener("webglcontextrestored", () => {
      if (this.#opened) this.#opened.renderer = this.#newRenderer(gl, store);
      this.#layout.problems.clear();
      this.#draw();
    });
    this.#state = initialState(model.name);
    this.#state = scenes.known(fromHash(this.#given || this.getAttribute("state") || "", this.#state));
    this.#fitCanvas();
    this.#change({});
    // Tiles and programs are on their way by now.
    this.#layout.fill(store.attributes.title, panel.element, notes.element);
  }

  #newPanel(store: PublishedStore): Panel {
    return new Panel(store, this.#layout.messages, {
      change: (change) => this.#change(change),
      light: (change) => this.#changeLight(change),
      tool: (tool) => this.#choose(tool),
      fit: () => this.showAll(),
      fullSize: () => this.showFullSize(),
      zoom: (factor) => this.zoom(factor, ...this.#layout.middle),
      snapshot: () => void this.#saveSnapshot(),
      bookmark: () => void copyAddress(this.hash, this.#layout.problems),
      lightAsPhotograph: () => this.#lightAsPhotograph(),
    });
  }

  #newRenderer(gl: WebGL2RenderingContext, store: PublishedStore): Renderer {
    const residual = store.attributes.models.some((model) => model.residual);
    const usual = DEFAULT_CACHE_MB[residual ? "residual" : "plain"];
    const megabytes = Number(this.getAttribute("cache-mb")) || usual;
    const renderer = new Renderer(gl, store, Math.max(megabytes, 32) * MEGABYTE);
    renderer.tiles.onload = () => this.#draw();
    renderer.tiles.onproblem = (problem) => this.#report(problem);
    return renderer;
  }

  #change(change: Partial<State>): void {
    if (!this.#opened) return;
    const { scenes, panel } = this.#opened;
    this.#state = scenes.after(this.#state, change);
    this.#changed = performance.now();
    panel.update(this.#state);
    this.#drawOverlay();
    this.#draw();
    this.#tell("impasto-change", { state: this.#state, hash: this.hash });
  }

  #changeLight(change: Partial<Light>): void {
    let light: Light = { ...this.#state.lights[this.#state.active]!, ...change };
    if (this.#state.arm) light = { ...light, ...ontoArm(light.zenith, light.azimuth) };
    const lights = this.#state.lights.map((other, i) => (i === this.#state.active ? light : other));
    this.#change({ lights });
  }

  #lightAsPhotograph(): void {
    const photograph = this.#opened!.scenes.photograph(this.#state);
    if (photograph === null) return;
    this.#change({ arm: false, lights: [this.#state.lights[this.#state.active]!], active: 0 });
    this.#changeLight(this.#opened!.scenes.lightOf(photograph));
  }

  #tell(name: keyof ImpastoViewerEvents, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }

  // Drawing

  #fitCanvas(): void {
    if (this.#layout.fitCanvas(this.clientWidth) && this.#opened) this.#drawNow();
    this.#drawOverlay();
  }

  #viewport(): Viewport {
    const { width, height } = this.#layout.canvas;
    const panes = this.#state.compare && this.#state.split === "side" ? 2 : 1;
    return { width, height, pane: width / panes, ratio: this.#layout.ratio };
  }

  #view(): View {
    return this.#state.view ?? fitted(this.#viewport(), this.#opened!.store);
  }

  #scene(still: boolean): Scene {
    return this.#opened!.scenes.scene(this.#state, this.#view(), still);
  }

  #draw(): void {
    if (this.#frame || !this.#opened) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.#drawNow();
    });
  }

  #drawNow(): void {
    const { renderer } = this.#opened!;
    const scene = this.#scene(performance.now() - this.#changed > SETTLED_MS);
    const complete = renderer.draw(scene);
    const reached = this.#milestones.frame(renderer, complete);
    if (reached) {
      this.#drawOverlay();
      const { requests } = this.#opened!.store.http;
      void reached.then((milestone) => this.#tell("impasto-ready", { requests, ...milestone }));
    }
    if (renderer.compiling) {
      setTimeout(() => this.#draw(), renderer.drawn ? COMPILE_MS.something : COMPILE_MS.nothing);
    }
    // Once more, smoothly, when nothing has changed for a while.
    if (!scene.still) {
      const changed = this.#changed;
      setTimeout(() => this.#changed === changed && this.#draw(), SETTLED_MS + 10);
    }
  }

  #drawOverlay(): void {
    if (!this.#opened) return;
    this.#layout.overlay.update(this.#opened.scenes, {
      state: this.#state,
      loading: !this.#milestones.whole,
      rule: this.#rule,
      notes: this.#opened.notes.annotations.list,
      toPage: (x, y) => this.toPage(x, y),
    });
  }

  // Places

  /** The place in the picture, in its pixels, that lies under a place in the element. */
  toPicture(x: number, y: number): [number, number] {
    return toPicture(this.#viewport(), this.#view(), x, y);
  }

  /** The place in the element under which a place of the picture lies. */
  toPage(x: number, y: number): [number, number] {
    return toPage(this.#viewport(), this.#view(), x, y);
  }

  // What gestures and keys ask for

  pan(dx: number, dy: number): void {
    if (!this.#opened) return;
    this.#change({ view: panned(this.#viewport(), this.#view(), this.#opened.store, dx, dy) });
  }

  zoom(factor: number, x: number, y: number): void {
    if (!this.#opened) return;
    this.#change({ view: zoomed(this.#viewport(), this.#view(), this.#opened.store, factor, x, y) });
  }

  drag(phase: "start" | "move" | "end", x: number, y: number, event: PointerEvent): boolean {
    if (!this.#opened) return false;
    if (this.#tool === "light" || (phase === "start" ? event.altKey : this.#draggingLight)) {
      this.#draggingLight = phase !== "end";
      const [middleX, middleY] = this.#layout.middle;
      const side = Math.min(middleX, middleY);
      this.#changeLight(fromPlace((x - middleX) / side, (y - middleY) / side));
      return true;
    }
    if (this.#tool !== "ruler") return false;
    const [px, py] = this.toPicture(x, y);
    this.#rule =
      phase === "start" || !this.#rule
        ? { x1: px, y1: py, x2: px, y2: py }
        : { ...this.#rule, x2: px, y2: py };
    this.#drawOverlay();
    return true;
  }

  tap(x: number, y: number): void {
    if (!this.#opened) return;
    const { store, notes } = this.#opened;
    const [px, py] = this.toPicture(x, y).map(Math.floor) as [number, number];
    if (px < 0 || py < 0 || px >= store.width || py >= store.height) return;
    if (this.#tool === "annotate") {
      this.#layout.showSide(true);
      notes.write(px, py);
    } else void this.inspect(px, py);
  }

  showAll(): void {
    this.#change({ view: null });
  }

  showFullSize(): void {
    if (this.#opened) this.#change({ view: { ...this.#view(), scale: 1 } });
  }

  key(event: KeyboardEvent): void {
    if (this.#opened) pressed(event, this, this.#layout.middle);
  }

  /** Moves the swipe line. */
  swipe(change: (share: number) => number): void {
    this.#change({ swipe: change(this.#state.swipe) });
  }

  /** Shows the view and the light of a note. */
  open(note: string): void {
    this.#opened?.notes.open(note);
  }

  /** Shows the parameters and the curve of a pixel. */
  async inspect(x: number, y: number): Promise<void> {
    const { scenes, inspector, store } = this.#opened!;
    const { model, compare, lights, active } = this.#state;
    const shown = [model, ...(compare.startsWith("model:") ? [compare.slice("model:".length)] : [])];
    this.#layout.detail(this.#layout.messages.loading);
    try {
      const models = shown.map((name) => scenes.model(name));
      this.#layout.detail(await inspector.panel(models, x, y, lights[active]!.azimuth));
    } catch (error) {
      this.#layout.detail(null);
      this.#report(asProblem(error, store.http.url.href));
    }
    this.#tell("impasto-pixel", { x, y });
  }

  #choose(tool: Tool): void {
    this.#tool = tool;
    if (tool !== "ruler") this.#rule = null;
    this.#layout.canvas.classList.toggle("tool", tool !== "inspect");
    this.#drawOverlay();
  }

  // What leaves the page

  /** The present picture as a PNG file with its colour profile. */
  async snapshot(): Promise<Blob> {
    const { renderer, store } = this.#opened!;
    renderer.draw(this.#scene(true), true);
    return saved(this.#layout.canvas, store.attributes.display.profile);
  }

  async #saveSnapshot(): Promise<void> {
    const { title } = this.#opened!.store.attributes;
    download(await this.snapshot(), `${title.replace(/[^\w.-]+/g, "-")}.png`);
  }

  #report(problem: StoreProblem): void {
    const { kind, where, detail } = problem;
    this.#tell("impasto-problem", { kind, where, detail });
    this.#layout.problems.say(this.#layout.problems.words(problem));
  }
}

if (!customElements.get("impasto-viewer")) customElements.define("impasto-viewer", ImpastoViewer);

declare global {
  interface HTMLElementTagNameMap {
    "impasto-viewer": ImpastoViewer;
  }
  interface HTMLElementEventMap extends ImpastoViewerEvents {}
}
