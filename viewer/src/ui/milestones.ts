/** When there was something to look at, and when all of it was there: told when the graphics card has drawn it. */

import type { Renderer } from "../gl/renderer";

export interface Milestone {
  /** Since the store was asked for. */
  readonly first: number;
  readonly milliseconds: number;
}

export class Milestones {
  readonly #started = performance.now();
  #first: Promise<number> | null = null;
  #whole = false;

  /** Whether all tiles of the first view have been drawn. */
  get whole(): boolean {
    return this.#whole;
  }

  /** Notes a frame; returns what was reached once the first complete one has been drawn, otherwise null. */
  frame(renderer: Renderer, complete: boolean): Promise<Milestone> | null {
    if (this.#whole || !renderer.drawn) return null;
    const drawn = renderer.finished().then(() => performance.now() - this.#started);
    this.#first ??= drawn;
    if (!complete) return null;
    this.#whole = true;
    return Promise.all([this.#first, drawn]).then(([first, milliseconds]) => ({ first, milliseconds }));
  }
}
