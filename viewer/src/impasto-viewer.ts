/**
 * The element `<impasto-viewer src="…/painting.zarr">`; docs/publish.md lists its attributes and events.
 */

import { type BasisCase, type BasisOptics, evaluateBasis } from "./gl/basis";
import { Renderer } from "./gl/renderer";
import type { Content, Range, Scene, View } from "./gl/scene";
import { findModel, MODELS, type Model } from "./models";
import { asProblem, type StoreProblem } from "./store/errors";
import { type ModelEntry, PublishedStore } from "./store/published";
import { Annotations } from "./ui/annotations";
import { download, h, svg } from "./ui/dom";
import { attachGestures, type GestureTarget } from "./ui/gestures";
import { fromPlace, ontoArm } from "./ui/hemisphere";
import { type Messages, messagesFor } from "./ui/i18n";
import { Inspector } from "./ui/inspector";
import { legend } from "./ui/legend";
import { angles, shaderLights } from "./ui/lights";
import { columnLabel, contentOf, findColumn, findRange, hasLegend } from "./ui/maps";
import { NotesPanel } from "./ui/notes-panel";
import { Panel, type Tool } from "./ui/panel";
import { withProfile } from "./ui/snapshot";
import { clamp, fromHash, initialState, type Light, type State, toHash } from "./ui/state";
import css from "./viewer.css?inline";

export type { Light, State } from "./ui/state";

/** Events of the element, by name, with what they tell. */
export interface ImpastoViewerEvents {
  /** All of the first view is drawn; `first` says when there was something to look at, if only coarse. */
  "impasto-ready": CustomEvent<{ requests: number; milliseconds: number; first: number }>;
  /** The view, the light or what is shown has changed. */
  "impasto-change": CustomEvent<{ state: State; hash: string }>;
  "impasto-problem": CustomEvent<{ kind: string; where: string; detail: string }>;
  "impasto-pixel": CustomEvent<{ x: number; y: number }>;
}

const sheet = new CSSStyleSheet();
sheet.replaceSync(css);

const MEGABYTE = 1 << 20;
const DEFAULT_CACHE_MB = 160;
const NARROW_PX = 700;
const SETTLED_MS = 160;
const NO_RANGE: Range = { low: 0, high: 1, logarithmic: false };
const LARGEST_SCALE = 32;
const MOST_PROBLEMS = 3;

export class ImpastoViewer extends HTMLElement implements GestureTarget {
  static readonly observedAttributes = ["src", "lang", "cache-mb"];

  readonly #root = this.attachShadow({ mode: "open" });
  #messages: Messages = messagesFor([]);
  #canvas = h("canvas");
  #stage = h("div");
  #side = h("div");
  #details = h("div");
  #overlay = h("div");
  #problems = h("div");
  #showSide: (open: boolean) => void = () => {};
  #divider = h("div");
  #handle = h("button");
  #store: PublishedStore | null = null;
  #renderer: Renderer | null = null;
  #inspector: Inspector | null = null;
  #panel: Panel | null = null;
  #notes: NotesPanel | null = null;
  #state: State = initialState("");
  #given = ""; // a state asked for before the store was there
  #tool: Tool = "inspect";
  #rule: { x1: number; y1: number; x2: number; y2: number } | null = null;
  #ranges = new Map<string, Range>();
  #opening: AbortController | null = null;
  #frame = 0;
  #changed = 0;
  #ready = false;
  #started = 0;
  #first = 0;
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
    if (this.#store) this.#change(this.#known(fromHash(hash, { ...this.#state, view: null })));
    else this.#given = hash;
  }

  /** Whether all tiles of the present view are drawn. */
  get complete(): boolean {
    return this.#ready && this.#frame === 0 && this.#renderer?.tiles.pending === 0;
  }

  get store(): PublishedStore | null {
    return this.#store;
  }

  /** The models that the shader knows. */
  get models(): readonly Model[] {
    return MODELS;
  }

  /** Basis values of a model as the graphics card computes them: diffuse, and one per lobe, for each case. */
  basis(model: string, optics: BasisOptics, cases: readonly BasisCase[]): number[][] {
    const found = findModel(model);
    if (!found || !this.#renderer) throw new Error(`no model ${model}, or no store yet`);
    return evaluateBasis(this.#renderer.gl, found, optics, cases);
  }

  /** Bytes of tiles on the graphics card. */
  get cacheBytes(): number {
    return this.#renderer?.tiles.bytes ?? 0;
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
    this.#renderer?.dispose();
    this.#renderer = this.#store = this.#inspector = this.#panel = null;
    this.#ready = false;
  }

  async #open(): Promise<void> {
    this.#close();
    this.#messages = messagesFor([this.lang || document.documentElement.lang, ...navigator.languages]);
    this.#layOut();
    const src = this.getAttribute("src");
    if (!src) return;
    this.#opening = new AbortController();
    const { signal } = this.#opening;
    this.#started = performance.now();
    this.#first = 0;
    try {
      const store = await PublishedStore.open(new URL(src, document.baseURI), signal);
      if (!signal.aborted) this.#begin(store);
    } catch (error) {
      if (!signal.aborted) this.#fatal(this.#words(asProblem(error, src)), true);
    }
  }

  #layOut(): void {
    const m = this.#messages;
    this.#canvas = h("canvas", { tabindex: 0, role: "img", "aria-label": m.picture });
    this.#overlay = h("div", { class: "overlay" }, h("div", { class: "status", role: "status" }, m.loading));
    this.#problems = h("div", { class: "messages", role: "log", "aria-live": "polite" });
    this.#details = h("div", { class: "details", role: "region", "aria-live": "polite", hidden: true });
    this.#side = h("div", { class: "side", id: "side" });
    const toggle = h(
      "button",
      { type: "button", class: "toggle", "aria-expanded": "true", "aria-controls": "side" },
      "☰",
    );
    this.#showSide = (open) => {
      this.#side.classList.toggle("closed", !open);
      toggle.setAttribute("aria-expanded", String(open));
      toggle.setAttribute("aria-label", open ? m.hideControls : m.showControls);
    };
    toggle.addEventListener("click", () => this.#showSide(this.#side.classList.contains("closed")));
    this.#divider = this.#newDivider();
    this.#stage = h(
      "div",
      { class: "stage" },
      this.#canvas,
      this.#overlay,
      this.#divider,
      this.#problems,
      toggle,
    );
    const frame = h("div", { class: "frame" }, this.#stage, this.#side);
    this.#root.replaceChildren(frame);
    this.#showSide(!this.hasAttribute("closed"));
    this.#resize.observe(this.#stage);
    this.#resize.observe(this);
    attachGestures(this.#canvas, this);
    this.#canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  #begin(store: PublishedStore): void {
    const m = this.#messages;
    const { models, title } = store.attributes;
    if (models.length === 0) {
      this.#fatal(m.noModels, false);
      return;
    }
    const gl = this.#canvas.getContext("webgl2", {
      antialias: false,
      alpha: false,
      depth: false,
      preserveDrawingBuffer: false,
    });
    if (!gl) {
      this.#fatal(m.noWebgl, false);
      return;
    }
    this.#store = store;
    this.#renderer = this.#newRenderer(gl, store);
    this.#canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.#say(m.lostContext);
    });
    this.#canvas.addEventListener("webglcontextrestored", () => {
      this.#renderer = this.#newRenderer(gl, store);
      this.#problems.replaceChildren();
      this.#draw();
    });
    this.#inspector = new Inspector(gl, store, m);
    this.#ranges.clear();
    this.#panel = new Panel(store, m, {
      change: (change) => this.#change(change),
      light: (change) => this.#changeLight(change),
      tool: (tool) => this.#choose(tool),
      fit: () => this.#change({ view: null }),
      fullSize: () => this.#change({ view: { ...this.#view(), scale: 1 } }),
      zoom: (factor) => this.zoom(factor, this.#stage.clientWidth / 2, this.#stage.clientHeight / 2),
      snapshot: () => void this.#saveSnapshot(),
      bookmark: () => void this.#copyAddress(),
      lightAsPhotograph: () => this.#lightAsPhotograph(),
    });
    this.#notes = new NotesPanel(m, new Annotations(store.http.url.href), {
      hash: () => this.hash,
      show: (hash) => {
        this.hash = hash;
      },
      change: () => this.#drawOverlay(),
    });
    this.#side.replaceChildren(h("h2", {}, title), this.#details, this.#panel.element, this.#notes.element);
    this.#state = initialState(models[0]!.name);
    const given = this.#given || this.getAttribute("state") || "";
    this.#state = this.#known(fromHash(given, this.#state));
    this.#fitCanvas();
    this.#change({});
  }

  #newRenderer(gl: WebGL2RenderingContext, store: PublishedStore): Renderer {
    const megabytes = Number(this.getAttribute("cache-mb")) || DEFAULT_CACHE_MB;
    const renderer = new Renderer(gl, store, Math.max(megabytes, 32) * MEGABYTE);
    renderer.tiles.onload = () => this.#draw();
    renderer.tiles.onproblem = (problem) => this.#report(problem);
    return renderer;
  }

  /** A state with what this store does not have replaced. */
  #known(state: State): State {
    const { models, photographs } = this.#store!.attributes;
    const has = (name: string) => models.some((model) => model.name === name);
    const [kind, which] = state.compare.split(":");
    const photograph = which === "nearest" || Number(which) < (photographs?.lights.length ?? 0);
    const comparable = kind === "model" ? has(which!) : kind === "photograph" && photographs && photograph;
    const near = this.#store!.attributes.camera.mm_per_px !== null;
    return {
      ...state,
      model: has(state.model) ? state.model : models[0]!.name,
      compare: comparable ? state.compare : "",
      lights: near ? state.lights : state.lights.map((light) => ({ ...light, distance_mm: null })),
    };
  }

  #model(name = this.#state.model): ModelEntry {
    const { models } = this.#store!.attributes;
    return models.find((model) => model.name === name) ?? models[0]!;
  }

  #change(change: Partial<State>): void {
    let state = { ...this.#state, ...change };
    if (change.arm) {
      const lights = state.lights.map((light) => ({ ...light, ...ontoArm(light.zenith, light.azimuth) }));
      state = { ...state, lights };
    }
    const model = this.#model(state.model);
    if (state.show.includes(":") && !findColumn(state.show, model)) state = { ...state, show: "radiance" };
    if (state.show === "specular" && model.lobes === 0) state = { ...state, show: "radiance" };
    this.#state = state;
    this.#changed = performance.now();
    this.#panel?.update(state);
    this.#drawOverlay();
    this.#draw();
    const detail = { state, hash: this.hash };
    this.dispatchEvent(new CustomEvent("impasto-change", { detail, bubbles: true, composed: true }));
  }

  #changeLight(change: Partial<Light>): void {
    let light: Light = { ...this.#state.lights[this.#state.active]!, ...change };
    if (this.#state.arm) light = { ...light, ...ontoArm(light.zenith, light.azimuth) };
    const lights = this.#state.lights.map((other, i) => (i === this.#state.active ? light : other));
    this.#change({ lights });
  }

  // Drawing

  #fitCanvas(): void {
    const frame = this.#root.querySelector(".frame");
    frame?.classList.toggle("narrow", this.clientWidth < NARROW_PX);
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(Math.round(this.#stage.clientWidth * ratio), 1);
    const height = Math.max(Math.round(this.#stage.clientHeight * ratio), 1);
    if (this.#canvas.width !== width || this.#canvas.height !== height) {
      this.#canvas.width = width;
      this.#canvas.height = height;
      if (this.#renderer) this.#drawNow();
    }
    this.#drawOverlay();
  }

  #ratio(): number {
    return this.#canvas.width / Math.max(this.#stage.clientWidth, 1);
  }

  #paneWidth(): number {
    return this.#canvas.width / (this.#state.compare && this.#state.split === "side" ? 2 : 1);
  }

  #view(): View {
    const { width, height } = this.#store!;
    const fitted = Math.min(this.#paneWidth() / width, this.#canvas.height / height);
    return this.#state.view ?? { x: width / 2, y: height / 2, scale: fitted };
  }

  #scene(): Scene {
    const state = this.#state;
    return {
      view: this.#view(),
      contents: this.#contents(),
      swipe: state.split === "swipe" ? state.swipe : null,
      lights: shaderLights(state.lights, this.#store!.attributes.display.matrix),
      exposure: 2 ** state.exposure,
      exaggeration: state.exaggeration,
      smooth: performance.now() - this.#changed > SETTLED_MS && this.#view().scale < 1,
    };
  }

  #contents(): [Content] | [Content, Content] {
    const { show, compare } = this.#state;
    const first = contentOf(show, this.#model(), this.#store!, this.#range(show, this.#model()));
    const photograph = this.#photograph();
    if (photograph !== null) return [first, { kind: "photograph", light: photograph }];
    if (!compare) return [first];
    const other = this.#model(compare.slice("model:".length));
    return [first, contentOf(show, other, this.#store!, this.#range(show, this.#model()))];
  }

  #range(show: string, model: ModelEntry): Range {
    const key = `${model.name} ${show}`;
    const known = this.#ranges.get(key);
    if (known || !hasLegend(show, model)) return known ?? NO_RANGE;
    this.#ranges.set(key, NO_RANGE);
    findRange(show, model, this.#store!).then(
      (range) => {
        this.#ranges.set(key, range);
        this.#drawOverlay();
        this.#draw();
      },
      (error) => this.#report(asProblem(error, this.#store!.http.url.href)),
    );
    return NO_RANGE;
  }

  /** Which photograph is compared with, if one is. */
  #photograph(): number | null {
    const [kind, which] = this.#state.compare.split(":");
    if (kind !== "photograph") return null;
    return which === "nearest" ? this.#nearestPhotograph().index : Number(which);
  }

  #nearestPhotograph(): { index: number; angle_deg: number } {
    const [light] = shaderLights(
      [{ ...this.#state.lights[this.#state.active]!, size_deg: 0, distance_mm: null }],
      [],
    );
    const cosines = this.#store!.attributes.photographs!.lights.map(({ direction }) =>
      direction.reduce((sum, value, i) => sum + value * light!.place[i]!, 0),
    );
    const index = cosines.indexOf(Math.max(...cosines));
    return { index, angle_deg: (Math.acos(clamp(cosines[index]!, -1, 1)) * 180) / Math.PI };
  }

  #lightAsPhotograph(): void {
    const photograph = this.#photograph();
    if (photograph === null) return;
    const {
      direction,
      position_mm: position,
      intensity,
    } = this.#store!.attributes.photographs!.lights[photograph]!;
    const near = position && this.#store!.attributes.camera.mm_per_px !== null;
    const mean = intensity.reduce((sum, value) => sum + value, 0) / intensity.length;
    this.#change({ arm: false, lights: [this.#state.lights[this.#state.active]!], active: 0 });
    this.#changeLight({
      ...angles(near ? position : direction),
      distance_mm: near ? Math.hypot(...position) : null,
      intensity: mean,
    });
  }

  #draw(): void {
    if (this.#frame || !this.#renderer) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.#drawNow();
    });
  }

  #drawNow(): void {
    const scene = this.#scene();
    const complete = this.#renderer!.draw(scene);
    if (!this.#first && this.cacheBytes) this.#first = performance.now() - this.#started;
    if (complete && !this.#ready) {
      this.#ready = true;
      this.#drawOverlay();
      const milliseconds = performance.now() - this.#started;
      const detail = { requests: this.#store!.http.requests, milliseconds, first: this.#first };
      this.dispatchEvent(new CustomEvent("impasto-ready", { detail, bubbles: true, composed: true }));
    }
    // Once more, smoothly, when nothing has changed for a while.
    if (!scene.smooth && scene.view.scale < 1) {
      const changed = this.#changed;
      setTimeout(() => this.#changed === changed && this.#draw(), SETTLED_MS + 10);
    }
  }

  #drawOverlay(): void {
    if (!this.#store) return;
    const m = this.#messages;
    const state = this.#state;
    const parts: Element[] = [];
    this.#divider.hidden = !state.compare;
    if (!this.#ready) parts.push(h("div", { class: "status", role: "status" }, m.loading));
    if (hasLegend(state.show, this.#model())) parts.push(this.#legend());
    if (state.compare) parts.push(...this.#captions());
    if (this.#rule) parts.push(...this.#drawRule(this.#rule));
    this.#notes?.annotations.list.forEach((note, i) => {
      const [x, y] = this.toPage(note.x, note.y);
      const mark = h(
        "button",
        { type: "button", class: "note", title: note.text, "aria-label": note.text },
        String(i + 1),
      );
      mark.style.left = `${x}px`;
      mark.style.top = `${y}px`;
      mark.addEventListener("click", () => this.#notes!.open(note.id));
      parts.push(mark);
    });
    this.#overlay.replaceChildren(...parts);
  }

  #legend(): HTMLElement {
    const m = this.#messages;
    const { show } = this.#state;
    const model = this.#model();
    const range = this.#range(show, model);
    const found = findColumn(show, model);
    if (found) return legend(columnLabel(found.column, model, found.of, m), found.column.units, range);
    if (show === "height") return legend(m.height, this.#store!.attributes.height!.column.units, range);
    if (show === "ratio") return legend(m.ratio, "", range);
    return legend(m.gloss, this.#store!.attributes.white_reference ? m.glossUnits : m.relativeGloss, range);
  }

  #captions(): Element[] {
    const m = this.#messages;
    const { split, swipe, compare, model } = this.#state;
    const share = split === "swipe" ? swipe : 0.5;
    this.#divider.style.left = `${100 * share}%`;
    this.#handle.hidden = split === "side";
    const photograph = this.#photograph();
    let other = compare.slice("model:".length);
    if (photograph !== null) {
      const { name } = this.#store!.attributes.photographs!.lights[photograph]!;
      other = m.photograph(name);
      if (compare === "photograph:nearest")
        other += `, ${m.degreesAway(this.#nearestPhotograph().angle_deg)}`;
    }
    return [h("div", { class: "caption" }, model), h("div", { class: "caption right" }, other)];
  }

  /** The swipe line, which stays where it is in the document, or a drag of it would end. */
  #newDivider(): HTMLDivElement {
    const handle = h("button", { type: "button", "aria-label": this.#messages.swipe }, "⇔");
    this.#handle = handle;
    handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const box = this.#stage.getBoundingClientRect();
      this.#change({ swipe: clamp((event.clientX - box.left) / box.width, 0, 1) });
    });
    handle.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      this.#change({ swipe: clamp(this.#state.swipe + step, 0, 1) });
    });
    return h("div", { class: "divider", hidden: true }, handle);
  }

  #drawRule(rule: { x1: number; y1: number; x2: number; y2: number }): Element[] {
    const [x1, y1] = this.toPage(rule.x1, rule.y1);
    const [x2, y2] = this.toPage(rule.x2, rule.y2);
    const pixels = Math.hypot(rule.x2 - rule.x1, rule.y2 - rule.y1);
    const mm = this.#store!.attributes.camera.mm_per_px;
    const text = this.#messages.length(mm ? `${(pixels * mm).toPrecision(4)} mm` : `${pixels.toFixed(0)} px`);
    return [
      svg("svg", {}, svg("line", { x1, y1, x2, y2, class: "rule" })),
      h("div", { class: "caption above", role: "status" }, text),
    ];
  }

  // Places

  /** The place in the picture, in its pixels, that lies under a place in the element. */
  toPicture(x: number, y: number): [number, number] {
    const view = this.#view();
    const ratio = this.#ratio();
    const pane = this.#paneWidth();
    const across = (x * ratio) % pane;
    return [
      view.x + (across - pane / 2) / view.scale,
      view.y + (y * ratio - this.#canvas.height / 2) / view.scale,
    ];
  }

  /** The place in the element under which a place of the picture lies. */
  toPage(x: number, y: number): [number, number] {
    const view = this.#view();
    const ratio = this.#ratio();
    return [
      ((x - view.x) * view.scale + this.#paneWidth() / 2) / ratio,
      ((y - view.y) * view.scale + this.#canvas.height / 2) / ratio,
    ];
  }

  // What gestures and keys ask for

  pan(dx: number, dy: number): void {
    if (!this.#store) return;
    const view = this.#view();
    const ratio = this.#ratio();
    const x = clamp(view.x - (dx * ratio) / view.scale, 0, this.#store.width);
    const y = clamp(view.y - (dy * ratio) / view.scale, 0, this.#store.height);
    this.#change({ view: { ...view, x, y } });
  }

  zoom(factor: number, x: number, y: number): void {
    if (!this.#store) return;
    const view = this.#view();
    const { width, height } = this.#store;
    const least = Math.min(this.#paneWidth() / width, this.#canvas.height / height, 1) / 2;
    const scale = clamp(view.scale * factor, least, LARGEST_SCALE);
    const [px, py] = this.toPicture(x, y);
    // The place under the pointer stays there.
    const kept = view.scale / scale;
    this.#change({ view: { x: px + (view.x - px) * kept, y: py + (view.y - py) * kept, scale } });
  }

  drag(phase: "start" | "move" | "end", x: number, y: number, event: PointerEvent): boolean {
    if (!this.#store) return false;
    if (this.#tool === "light" || (phase === "start" ? event.altKey : this.#draggingLight)) {
      this.#draggingLight = phase !== "end";
      const side = Math.min(this.#stage.clientWidth, this.#stage.clientHeight) / 2;
      const [dx, dy] = [x - this.#stage.clientWidth / 2, y - this.#stage.clientHeight / 2];
      const { zenith, azimuth } = fromPlace((46 * dx) / side, (46 * dy) / side);
      this.#changeLight({ zenith, azimuth });
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

  #draggingLight = false;

  tap(x: number, y: number): void {
    if (!this.#store) return;
    const [px, py] = this.toPicture(x, y).map(Math.floor) as [number, number];
    if (px < 0 || py < 0 || px >= this.#store.width || py >= this.#store.height) return;
    if (this.#tool === "annotate") {
      this.#showSide(true);
      this.#notes!.write(px, py);
    } else void this.inspect(px, py);
  }

  /** Shows the parameters and the curve of a pixel. */
  async inspect(x: number, y: number): Promise<void> {
    const other = this.#state.compare.startsWith("model:") ? [this.#model(this.#state.compare.slice(6))] : [];
    const { azimuth } = this.#state.lights[this.#state.active]!;
    this.#details.hidden = false;
    this.#showSide(true);
    this.#details.replaceChildren(this.#messages.loading);
    try {
      const panel = await this.#inspector!.panel([this.#model(), ...other], x, y, azimuth);
      const close = h(
        "button",
        { type: "button", onclick: () => (this.#details.hidden = true) },
        this.#messages.close,
      );
      this.#details.replaceChildren(panel, close);
      this.#details.scrollIntoView({ block: "nearest" });
    } catch (error) {
      this.#details.hidden = true;
      this.#report(asProblem(error, this.#store!.http.url.href));
    }
    this.dispatchEvent(new CustomEvent("impasto-pixel", { detail: { x, y }, bubbles: true, composed: true }));
  }

  #choose(tool: Tool): void {
    this.#tool = tool;
    if (tool !== "ruler") this.#rule = null;
    this.#canvas.classList.toggle("tool", tool !== "inspect");
    this.#drawOverlay();
  }

  #key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || !this.#store) return;
    const step = event.shiftKey ? 200 : 50;
    const [x, y] = [this.#stage.clientWidth / 2, this.#stage.clientHeight / 2];
    const actions: Record<string, () => void> = {
      ArrowLeft: () => this.pan(step, 0),
      ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step),
      ArrowDown: () => this.pan(0, -step),
      "+": () => this.zoom(1.25, x, y),
      "=": () => this.zoom(1.25, x, y),
      "-": () => this.zoom(0.8, x, y),
      "0": () => this.#change({ view: null }),
      "1": () => this.#change({ view: { ...this.#view(), scale: 1 } }),
      i: () => this.tap(x, y),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // What leaves the page

  /** The present picture as a PNG file with its colour profile. */
  async snapshot(): Promise<Blob> {
    this.#renderer!.draw({ ...this.#scene(), smooth: this.#view().scale < 1 });
    const png = await new Promise<Blob>((resolve, reject) =>
      this.#canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png"),
    );
    const profile = this.#store!.attributes.display.profile;
    return profile
      ? withProfile(
          png,
          Uint8Array.from(atob(profile), (c) => c.charCodeAt(0)),
        )
      : png;
  }

  async #saveSnapshot(): Promise<void> {
    download(await this.snapshot(), `${this.#store!.attributes.title.replace(/[^\w.-]+/g, "-")}.png`);
  }

  async #copyAddress(): Promise<void> {
    const url = new URL(location.href);
    url.hash = this.hash;
    try {
      await navigator.clipboard.writeText(url.href);
      this.#say(this.#messages.copied, 2500);
    } catch {
      this.#say(url.href);
    }
  }

  // What goes wrong

  #words(problem: StoreProblem): string {
    return this.#messages.problems[problem.kind](problem.where, problem.detail);
  }

  #report(problem: StoreProblem): void {
    const { kind, where, detail } = problem;
    this.dispatchEvent(
      new CustomEvent("impasto-problem", { detail: { kind, where, detail }, bubbles: true, composed: true }),
    );
    this.#say(this.#words(problem));
  }

  #say(text: string, milliseconds = 0): void {
    if ([...this.#problems.children].some((child) => child.firstChild?.textContent === text)) return;
    const box = h("div", { class: "problem" }, h("div", {}, text));
    box.append(h("button", { type: "button", onclick: () => box.remove() }, this.#messages.dismiss));
    while (this.#problems.children.length >= MOST_PROBLEMS) this.#problems.firstChild!.remove();
    this.#problems.append(box);
    if (milliseconds) setTimeout(() => box.remove(), milliseconds);
  }

  #fatal(text: string, again: boolean): void {
    const parts: Element[] = [h("p", { role: "alert" }, text)];
    if (again)
      parts.push(h("button", { type: "button", onclick: () => void this.#open() }, this.#messages.again));
    this.#overlay.replaceChildren();
    this.#stage.append(h("div", { class: "fatal" }, ...parts));
  }
}

if (!customElements.get("impasto-viewer")) customElements.define("impasto-viewer", ImpastoViewer);

declare global {
  interface HTMLElementTagNameMap {
    "impasto-viewer": ImpastoViewer;
  }
  interface HTMLElementEventMap extends ImpastoViewerEvents {}
}
