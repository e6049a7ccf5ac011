/** The parts of the element and where they stand. */

import { h } from "./dom";
import type { Messages } from "./i18n";
import { Overlay } from "./overlay";
import { Problems } from "./problems";

const NARROW_PX = 700;

export interface LayoutActions {
  key(event: KeyboardEvent): void;
  swipe(change: (share: number) => number): void;
  open(note: string): void;
}

export class Layout {
  readonly canvas: HTMLCanvasElement;
  readonly overlay: Overlay;
  readonly problems: Problems;
  /** What lies over the picture, and everything. */
  readonly stage: HTMLElement;
  readonly frame: HTMLElement;
  readonly #details: HTMLElement;
  readonly #side = h("div", { class: "side", id: "side" });
  readonly #toggle: HTMLElement;

  constructor(
    readonly messages: Messages,
    actions: LayoutActions,
  ) {
    const m = messages;
    this.canvas = h("canvas", { tabindex: 0, role: "img", "aria-label": m.picture });
    this.canvas.addEventListener("keydown", (event) => actions.key(event));
    this.overlay = new Overlay(m, actions);
    this.problems = new Problems(m);
    this.#details = h("div", { class: "details", role: "region", "aria-live": "polite", hidden: true });
    this.#toggle = h("button", { type: "button", class: "toggle", "aria-controls": "side" }, "☰");
    this.#toggle.addEventListener("click", () => this.showSide(this.#side.classList.contains("closed")));
    this.stage = h(
      "div",
      { class: "stage" },
      this.canvas,
      this.overlay.divider,
      this.overlay.element,
      this.problems.element,
      this.#toggle,
    );
    this.frame = h("div", { class: "frame" }, this.stage, this.#side);
  }

  /** The context to draw with, null where the browser has none. */
  context(): WebGL2RenderingContext | null {
    return this.canvas.getContext("webgl2", { antialias: false, alpha: false, depth: false });
  }

  /** Puts the controls beside the picture. */
  fill(title: string, ...controls: HTMLElement[]): void {
    this.#side.replaceChildren(h("h2", {}, title), this.#details, ...controls);
  }

  /** Shows details of a pixel above the controls, or hides them. */
  detail(content: HTMLElement | string | null): void {
    const details = this.#details;
    details.hidden = content === null;
    if (content === null) return;
    this.showSide(true);
    const close = h("button", { type: "button", onclick: () => this.detail(null) }, this.messages.close);
    details.replaceChildren(content, ...(typeof content === "string" ? [] : [close]));
    details.scrollIntoView({ block: "nearest" });
  }

  showSide(open: boolean): void {
    this.#side.classList.toggle("closed", !open);
    this.#toggle.setAttribute("aria-expanded", String(open));
    this.#toggle.setAttribute("aria-label", open ? this.messages.hideControls : this.messages.showControls);
  }

  /** Pixels of the canvas per pixel of the page. */
  get ratio(): number {
    return this.canvas.width / Math.max(this.stage.clientWidth, 1);
  }

  /** The middle of the picture, in pixels of the page. */
  get middle(): [number, number] {
    return [this.stage.clientWidth / 2, this.stage.clientHeight / 2];
  }

  /** Gives the canvas the pixels of the display, in an element so wide; returns whether their number has changed. */
  fitCanvas(elementWidth: number): boolean {
    this.frame.classList.toggle("narrow", elementWidth < NARROW_PX);
    const pixels = (length: number) => Math.max(Math.round(length * (window.devicePixelRatio || 1)), 1);
    const [width, height] = [pixels(this.stage.clientWidth), pixels(this.stage.clientHeight)];
    if (this.canvas.width === width && this.canvas.height === height) return false;
    this.canvas.width = width;
    this.canvas.height = height;
    return true;
  }

  /** Says why there is no picture. */
  fail(text: string, again?: () => void): void {
    this.overlay.clear();
    this.stage.append(this.problems.fatal(text, again));
  }
}
