/** The controls beside the picture. They show a state and ask for changes of it; they keep nothing themselves. */

import type { PublishedStore } from "../store/published";
import { h } from "./dom";
import { armAngle, Hemisphere } from "./hemisphere";
import type { Messages } from "./i18n";
import { basicChoices, type Choice, columnChoices } from "./maps";
import { FIRST_LIGHT, type Light, MOST_LIGHTS, type State } from "./state";

export type Tool = "inspect" | "light" | "ruler" | "annotate";

export interface PanelActions {
  change(change: Partial<State>): void;
  light(change: Partial<Light>): void;
  tool(tool: Tool): void;
  fit(): void;
  fullSize(): void;
  zoom(factor: number): void;
  snapshot(): void;
  bookmark(): void;
  lightAsPhotograph(): void;
}

const FARTHEST_MM = 5000;
const RAKING_ZENITH = 82;

export class Panel {
  readonly element: HTMLElement;
  readonly #hemisphere: Hemisphere;
  readonly #refreshers: ((state: State) => void)[] = [];
  readonly #near: boolean;

  constructor(
    readonly store: PublishedStore,
    readonly messages: Messages,
    readonly actions: PanelActions,
  ) {
    const m = messages;
    this.#near = store.attributes.camera.mm_per_px !== null;
    this.#hemisphere = new Hemisphere(
      m,
      (zenith, azimuth) => actions.light({ zenith, azimuth }),
      (active) => actions.change({ active }),
    );
    this.element = h(
      "form",
      { class: "panel", "aria-label": m.controls, onsubmit: (event) => event.preventDefault() },
      h("fieldset", {}, h("legend", {}, m.show), ...this.#showing()),
      h("fieldset", {}, h("legend", {}, m.light), ...this.#lighting()),
      h("fieldset", {}, h("legend", {}, m.compare), ...this.#comparing()),
      h("fieldset", {}, h("legend", {}, m.tools), ...this.#tools()),
    );
  }

  update(state: State): void {
    this.#hemisphere.update(state.lights, state.active, state.arm);
    for (const refresh of this.#refreshers) refresh(state);
  }

  #showing(): HTMLElement[] {
    const m = this.messages;
    const { models } = this.store.attributes;
    const model = this.#select(
      m.model,
      models.map(({ name, title }) => ({ value: name, label: `${name} · ${title}` })),
      (state) => state.model,
      (value) => this.actions.change({ model: value }),
    );
    const show = h("select", { onchange: () => this.actions.change({ show: show.value }) });
    let shownFor = "";
    this.#refreshers.push((state) => {
      if (shownFor !== state.model) {
        shownFor = state.model;
        const entry = models.find(({ name }) => name === state.model)!;
        show.replaceChildren(
          ...basicChoices(this.store, entry, m).map(option),
          h("optgroup", { label: m.measured }, ...columnChoices(entry, "parameters", m).map(option)),
          h("optgroup", { label: m.uncertainty }, ...columnChoices(entry, "quality", m).map(option)),
        );
      }
      show.value = state.show;
    });
    const add = h("input", {
      type: "checkbox",
      onchange: () => this.actions.change({ residual: add.checked }),
    });
    const residual = h("label", { class: "check" }, add, m.addResidual);
    this.#refreshers.push((state) => {
      add.checked = state.residual;
      residual.hidden = !models.find(({ name }) => name === state.model)?.residual;
    });
    return [
      model,
      labelled(m.show, show),
      residual,
      this.#slider(
        m.exposure,
        -5,
        5,
        0.1,
        (s) => s.exposure,
        (v) => this.actions.change({ exposure: v }),
        (v) => `${signed(v)} ${m.stops}`,
      ),
      this.#slider(
        m.exaggeration,
        0,
        6,
        0.1,
        (s) => s.exaggeration,
        (v) => this.actions.change({ exaggeration: v }),
        (v) => `× ${(1 + v).toFixed(1)}`,
      ),
    ];
  }

  #lighting(): HTMLElement[] {
    const m = this.messages;
    const light = (state: State) => state.lights[state.active]!;
    const degrees = (value: number) => `${value.toFixed(0)}°`;
    const angle = this.#slider(
      m.angle,
      -89,
      89,
      1,
      (s) => armAngle(light(s)),
      (v) => this.actions.light({ zenith: Math.abs(v), azimuth: v < 0 ? 180 : 0 }),
      degrees,
    );
    const zenith = this.#slider(
      m.zenith,
      0,
      89,
      1,
      (s) => light(s).zenith,
      (v) => this.actions.light({ zenith: v }),
      degrees,
    );
    const azimuth = this.#slider(
      m.azimuth,
      0,
      359,
      1,
      (s) => (light(s).azimuth + 360) % 360,
      (v) => this.actions.light({ azimuth: v }),
      degrees,
    );
    const arm = h("input", {
      type: "checkbox",
      onchange: () => this.actions.change({ arm: arm.checked }),
    });
    const which = h("select", { onchange: () => this.actions.change({ active: Number(which.value) }) });
    const add = this.#button(m.addLight, (state) => ({
      lights: [...state.lights, { ...FIRST_LIGHT, ...opposite(light(state)) }],
      active: state.lights.length,
    }));
    const remove = this.#button(m.removeLight, (state) => ({
      lights: state.lights.filter((_, i) => i !== state.active),
      active: 0,
    }));
    const chosen = labelled(m.light, which);
    this.#refreshers.push((state) => {
      arm.checked = state.arm;
      angle.hidden = !state.arm;
      zenith.hidden = azimuth.hidden = state.arm;
      which.replaceChildren(
        ...state.lights.map((_, i) => option({ value: String(i), label: m.lightNumber(i + 1) })),
      );
      which.value = String(state.active);
      chosen.hidden = state.lights.length < 2;
      add.disabled = state.lights.length >= MOST_LIGHTS;
      remove.hidden = state.lights.length < 2;
    });
    const raking = h(
      "button",
      { type: "button", onclick: () => this.actions.light({ zenith: RAKING_ZENITH }) },
      m.raking,
    );
    const parts = [
      this.#hemisphere.element as unknown as HTMLElement,
      chosen,
      h("label", { class: "check" }, arm, m.arm),
      angle,
      zenith,
      azimuth,
      h("div", { class: "buttons" }, raking, add, remove),
      this.#slider(
        m.intensity,
        0,
        4,
        0.05,
        (s) => light(s).intensity,
        (v) => this.actions.light({ intensity: v }),
        (v) => `× ${v.toFixed(2)}`,
      ),
      this.#slider(
        m.temperature,
        2000,
        12000,
        4,
        (s) => light(s).kelvin,
        (v) => this.actions.light({ kelvin: v }),
        (v) => `${v.toFixed(0)} K`,
      ),
      this.#slider(
        m.size,
        0,
        30,
        0.5,
        (s) => light(s).size_deg,
        (v) => this.actions.light({ size_deg: v }),
        (v) => `${v.toFixed(1)}°`,
      ),
    ];
    if (this.#near) {
      const distance = (v: number) => (v >= FARTHEST_MM ? null : v);
      const { models } = this.store.attributes;
      const told = models.some((model) => model.self_calibration?.distances?.told);
      const farthest = told ? m.asPhotographed : m.farAway;
      parts.push(
        this.#slider(
          m.distance,
          100,
          FARTHEST_MM,
          10,
          (s) => light(s).distance_mm ?? FARTHEST_MM,
          (v) => this.actions.light({ distance_mm: distance(v) }),
          (v) => (distance(v) === null ? farthest : `${v.toFixed(0)} mm`),
        ),
      );
    }
    return parts;
  }

  #comparing(): HTMLElement[] {
    const m = this.messages;
    const { models, photographs } = this.store.attributes;
    const choices: Choice[] = [
      { value: "", label: m.nothing },
      ...models.map(({ name }) => ({ value: `model:${name}`, label: m.withModel(name) })),
    ];
    if (models.some((model) => model.residual)) choices.push({ value: "alone", label: m.modelAlone });
    if (photographs) {
      choices.push({ value: "photograph:nearest", label: m.nearestPhotograph });
      choices.push(
        ...photographs.lights.map(({ name }, i) => ({ value: `photograph:${i}`, label: m.photograph(name) })),
      );
    }
    const split = this.#select(
      m.arrangement,
      [
        { value: "swipe", label: m.bySwipe },
        { value: "side", label: m.sideBySide },
      ],
      (state) => state.split,
      (value) => this.actions.change({ split: value as State["split"] }),
    );
    const swipe = this.#slider(
      m.swipe,
      0,
      1,
      0.01,
      (s) => s.swipe,
      (v) => this.actions.change({ swipe: v }),
      (v) => `${(100 * v).toFixed(0)} %`,
    );
    const as = h(
      "button",
      { type: "button", onclick: () => this.actions.lightAsPhotograph() },
      m.lightAsPhotograph,
    );
    this.#refreshers.push((state) => {
      split.hidden = !state.compare;
      swipe.hidden = !state.compare || state.split !== "swipe";
      as.hidden = !state.compare.startsWith("photograph");
    });
    const compare = this.#select(
      m.compare,
      choices,
      (s) => s.compare,
      (value) => this.actions.change({ compare: value }),
    );
    return [compare, split, swipe, as];
  }

  #tools(): HTMLElement[] {
    const m = this.messages;
    const tools: [Tool, string][] = [
      ["inspect", m.inspect],
      ["light", m.dragLight],
      ["ruler", m.ruler],
      ["annotate", m.annotate],
    ];
    const radios = tools.map(([tool, label]) => {
      const input = h("input", {
        type: "radio",
        name: "tool",
        value: tool,
        checked: tool === "inspect",
        onchange: () => this.actions.tool(tool),
      });
      return h("label", { class: "check" }, input, label);
    });
    const button = (label: string, action: () => void) =>
      h("button", { type: "button", onclick: action }, label);
    return [
      h("div", { role: "radiogroup", "aria-label": m.tools }, ...radios),
      h(
        "div",
        { class: "buttons" },
        button(m.fit, () => this.actions.fit()),
        button(m.fullSize, () => this.actions.fullSize()),
        button(m.zoomIn, () => this.actions.zoom(2)),
        button(m.zoomOut, () => this.actions.zoom(0.5)),
        button(m.snapshot, () => this.actions.snapshot()),
        button(m.bookmark, () => this.actions.bookmark()),
      ),
    ];
  }

  #state: State | undefined;

  #button(label: string, change: (state: State) => Partial<State>): HTMLButtonElement {
    this.#refreshers.push((state) => {
      this.#state = state;
    });
    return h(
      "button",
      { type: "button", onclick: () => this.#state && this.actions.change(change(this.#state)) },
      label,
    );
  }

  #select(
    label: string,
    choices: Choice[],
    value: (state: State) => string,
    change: (value: string) => void,
  ): HTMLElement {
    const select = h("select", { onchange: () => change(select.value) }, ...choices.map(option));
    this.#refreshers.push((state) => {
      select.value = value(state);
    });
    return labelled(label, select);
  }

  #slider(
    label: string,
    low: number,
    high: number,
    step: number,
    value: (state: State) => number,
    change: (value: number) => void,
    text: (value: number) => string,
  ): HTMLElement {
    const output = h("span", { class: "value", "aria-hidden": "true" });
    const input = h("input", {
      type: "range",
      "aria-label": label,
      min: low,
      max: high,
      step,
      oninput: () => change(Number(input.value)),
    });
    this.#refreshers.push((state) => {
      const now = value(state);
      input.value = String(now);
      output.textContent = text(now);
      input.setAttribute("aria-valuetext", output.textContent);
    });
    return h("label", { class: "slider" }, h("span", {}, label), output, input);
  }
}

function labelled(label: string, control: HTMLElement): HTMLElement {
  // The options of a list would count as a part of its label's text.
  control.setAttribute("aria-label", label);
  return h("label", {}, h("span", {}, label), control);
}

function option({ value, label }: Choice): HTMLOptionElement {
  return h("option", { value }, label);
}

function opposite({ zenith, azimuth }: Light): Pick<Light, "zenith" | "azimuth"> {
  return { zenith: Math.max(zenith, 20), azimuth: (azimuth + 180) % 360 };
}

function signed(value: number): string {
  return `${value > 0 ? "+" : ""}${value.toFixed(1)}`;
}
