/** What lies over the picture: legend, captions, swipe line, ruler and the marks of notes. */

import type { Annotation } from "./annotations";
import { h, svg } from "./dom";
import type { Messages } from "./i18n";
import { legend } from "./legend";
import { columnLabel, findColumn, hasLegend } from "./maps";
import type { Scenes } from "./scenes";
import { clamp, type State } from "./state";

export interface Rule {
  readonly x1: number;
  readonly y1: number;
  readonly x2: number;
  readonly y2: number;
}

export interface Shown {
  readonly state: State;
  readonly loading: boolean;
  readonly rule: Rule | null;
  readonly notes: readonly Annotation[];
  /** The place in the element under which a place of the picture lies. */
  toPage(x: number, y: number): [number, number];
}

export class Overlay {
  readonly element: HTMLElement;
  /** The swipe line, which stays where it is in the document, or a drag of it would end. */
  readonly divider: HTMLElement;
  readonly #handle: HTMLElement;

  constructor(
    readonly messages: Messages,
    readonly actions: { swipe(change: (share: number) => number): void; open(note: string): void },
  ) {
    this.element = h("div", { class: "overlay" }, this.#loading());
    const handle = h("button", { type: "button", "aria-label": messages.swipe }, "⇔");
    this.#handle = handle;
    this.divider = h("div", { class: "divider", hidden: true }, handle);
    handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const box = this.element.getBoundingClientRect();
      actions.swipe(() => clamp((event.clientX - box.left) / box.width, 0, 1));
    });
    handle.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      actions.swipe((share) => clamp(share + step, 0, 1));
    });
  }

  clear(): void {
    this.element.replaceChildren();
    this.divider.hidden = true;
  }

  update(scenes: Scenes, shown: Shown): void {
    const { state, rule, notes } = shown;
    const parts: Element[] = [];
    this.divider.hidden = !state.compare;
    if (shown.loading) parts.push(this.#loading());
    if (hasLegend(state.show, scenes.model(state.model))) parts.push(this.#legend(scenes, state));
    if (state.compare) parts.push(...this.#captions(scenes, state));
    if (rule) parts.push(...this.#ruler(scenes, rule, shown));
    notes.forEach((note, i) => {
      const mark = h(
        "button",
        { type: "button", class: "note", title: note.text, "aria-label": note.text },
        String(i + 1),
      );
      const [x, y] = shown.toPage(note.x, note.y);
      mark.style.left = `${x}px`;
      mark.style.top = `${y}px`;
      mark.addEventListener("click", () => this.actions.open(note.id));
      parts.push(mark);
    });
    this.element.replaceChildren(...parts);
  }

  #loading(): HTMLElement {
    return h("div", { class: "status", role: "status" }, this.messages.loading);
  }

  #legend(scenes: Scenes, { show, model: name }: State): HTMLElement {
    const m = this.messages;
    const { height, white_reference } = scenes.store.attributes;
    const model = scenes.model(name);
    const range = scenes.range(show, model);
    const found = findColumn(show, model);
    if (found) return legend(columnLabel(found.column, model, found.of, m), found.column.units, range);
    if (show === "height") return legend(m.height, height!.column.units, range);
    if (show === "ratio") return legend(m.ratio, "", range);
    if (show === "residual") return legend(m.residual, m.relativeRadiance, range);
    return legend(m.gloss, white_reference ? m.glossUnits : m.relativeGloss, range);
  }

  #captions(scenes: Scenes, state: State): Element[] {
    const m = this.messages;
    const { split, swipe, compare, model } = state;
    this.divider.style.left = `${100 * (split === "swipe" ? swipe : 0.5)}%`;
    this.#handle.hidden = split === "side";
    const photograph = scenes.photograph(state);
    let other = compare === "alone" ? m.modelAlone : compare.slice("model:".length);
    if (photograph !== null) {
      other = m.photograph(scenes.store.attributes.photographs!.lights[photograph]!.name);
      if (compare === "photograph:nearest") other += `, ${m.degreesAway(scenes.nearest(state).angle_deg)}`;
    }
    return [h("div", { class: "caption" }, model), h("div", { class: "caption right" }, other)];
  }

  #ruler(scenes: Scenes, rule: Rule, { toPage }: Shown): Element[] {
    const [x1, y1] = toPage(rule.x1, rule.y1);
    const [x2, y2] = toPage(rule.x2, rule.y2);
    const pixels = Math.hypot(rule.x2 - rule.x1, rule.y2 - rule.y1);
    const mm = scenes.store.attributes.camera.mm_per_px;
    const text = this.messages.length(mm ? `${(pixels * mm).toPrecision(4)} mm` : `${pixels.toFixed(0)} px`);
    return [
      svg("svg", {}, svg("line", { x1, y1, x2, y2, class: "rule" })),
      h("div", { class: "caption above", role: "status" }, text),
    ];
  }
}
