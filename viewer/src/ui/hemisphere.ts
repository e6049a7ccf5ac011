/** A hemisphere seen from above, on which lights are dragged: its middle is the painting's normal. */

import { svg } from "./dom";
import type { Messages } from "./i18n";
import { clamp, type Light } from "./state";

const RADIUS = 46;
const STEP_DEG = 2;
const LARGEST_ZENITH = 89;

/** A place on a hemisphere of radius 1 as it looks from above: the sine of the zenith angle away from its middle. */
export function toPlace(zenith: number, azimuth: number): [number, number] {
  const radius = Math.sin((zenith * Math.PI) / 180);
  const angle = (azimuth * Math.PI) / 180;
  return [radius * Math.cos(angle), -radius * Math.sin(angle)];
}

/** The inverse of `toPlace`. */
export function fromPlace(x: number, y: number): { zenith: number; azimuth: number } {
  const radius = Math.min(Math.hypot(x, y), 1);
  return {
    zenith: Math.min((Math.asin(radius) * 180) / Math.PI, LARGEST_ZENITH),
    azimuth: (Math.atan2(-y, x) * 180) / Math.PI,
  };
}

/** The nearest direction on the arm, which moves in the plane of X and Z. */
export function ontoArm(zenith: number, azimuth: number): { zenith: number; azimuth: number } {
  const sine = Math.sin((zenith * Math.PI) / 180) * Math.cos((azimuth * Math.PI) / 180);
  return { zenith: Math.abs((Math.asin(sine) * 180) / Math.PI), azimuth: sine < 0 ? 180 : 0 };
}

/** Signed angle on the arm. */
export function armAngle({ zenith, azimuth }: Pick<Light, "zenith" | "azimuth">): number {
  return Math.abs(azimuth) > 90 ? -zenith : zenith;
}

function drawnAt({ zenith, azimuth }: Light): [number, number] {
  const [x, y] = toPlace(zenith, azimuth);
  return [RADIUS * x, RADIUS * y];
}

export class Hemisphere {
  readonly element: SVGElement;
  readonly #dots: SVGElement;
  readonly #messages: Messages;
  #lights: readonly Light[] = [];
  #active = 0;
  #arm = false;

  constructor(
    messages: Messages,
    readonly change: (zenith: number, azimuth: number) => void,
    readonly choose: (light: number) => void,
  ) {
    this.#messages = messages;
    this.#dots = svg("g");
    const rings = [30, 60].map((zenith) =>
      svg("circle", { r: RADIUS * Math.sin((zenith * Math.PI) / 180), class: "ring" }),
    );
    this.element = svg(
      "svg",
      {
        viewBox: "-52 -52 104 104",
        class: "hemisphere",
        tabindex: 0,
        role: "slider",
        "aria-label": messages.lightDirection,
        "aria-valuemin": 0,
        "aria-valuemax": LARGEST_ZENITH,
      },
      svg("circle", { r: RADIUS, class: "dome" }),
      ...rings,
      svg("line", { x1: -RADIUS, x2: RADIUS, class: "arm" }),
      this.#dots,
    );
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      const [x, y] = this.#place(event);
      const near = this.#lights.findIndex((light) => {
        const [lx, ly] = drawnAt(light);
        return Math.hypot(lx - x, ly - y) < 7;
      });
      if (near >= 0 && near !== this.#active) this.choose(near);
      else this.#move(x, y);
    });
    this.element.addEventListener("pointermove", (event) => {
      if (this.element.hasPointerCapture(event.pointerId)) this.#move(...this.#place(event));
    });
    this.element.addEventListener("keydown", (event) => this.#key(event));
  }

  update(lights: readonly Light[], active: number, arm: boolean): void {
    this.#lights = lights;
    this.#active = active;
    this.#arm = arm;
    this.element.classList.toggle("on-arm", arm);
    this.#dots.replaceChildren(
      ...lights.map((light, index) => {
        const [cx, cy] = drawnAt(light);
        return svg("circle", { cx, cy, r: 5, class: index === active ? "light active" : "light" });
      }),
    );
    const light = lights[active]!;
    this.element.setAttribute("aria-valuenow", light.zenith.toFixed(0));
    this.element.setAttribute(
      "aria-valuetext",
      this.#messages.lightAt(Math.round(light.zenith), Math.round((light.azimuth + 360) % 360)),
    );
  }

  #place(event: PointerEvent): [number, number] {
    const box = this.element.getBoundingClientRect();
    const scale = 104 / Math.min(box.width, box.height);
    return [
      (event.clientX - box.left - box.width / 2) * scale,
      (event.clientY - box.top - box.height / 2) * scale,
    ];
  }

  #move(x: number, y: number): void {
    const { zenith, azimuth } = fromPlace(x / RADIUS, this.#arm ? 0 : y / RADIUS);
    this.change(zenith, azimuth);
  }

  /** Arrows move the light over the hemisphere as they point. */
  #key(event: KeyboardEvent): void {
    const moves: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, -1],
      ArrowDown: [0, 1],
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    event.stopPropagation();
    const light = this.#lights[this.#active]!;
    const step = event.shiftKey ? 5 * STEP_DEG : STEP_DEG;
    if (this.#arm) {
      const angle = clamp(armAngle(light) + step * (move[0] || -move[1]), -LARGEST_ZENITH, LARGEST_ZENITH);
      this.change(Math.abs(angle), angle < 0 ? 180 : 0);
      return;
    }
    // In the plane of zenith angles, where steps are equally long everywhere.
    const angle = (light.azimuth * Math.PI) / 180;
    const x = light.zenith * Math.cos(angle) + step * move[0];
    const y = light.zenith * Math.sin(angle) - step * move[1];
    this.change(Math.min(Math.hypot(x, y), LARGEST_ZENITH), (Math.atan2(y, x) * 180) / Math.PI);
  }
}
