// Screens between and before the comparisons, as trials of jsPsych.

import { type JsPsychPlugin, ParameterType, type TrialType } from "jspsych";

const INFO = {
  name: "screen",
  version: "1.0.0",
  parameters: { show: { type: ParameterType.FUNCTION, default: undefined } },
  data: { found: { type: ParameterType.OBJECT } },
} as const;

/** Ends when the promise of `show(display)` is kept, with what it found. */
export class Screen implements JsPsychPlugin<typeof INFO> {
  static info = INFO;

  async trial(display: HTMLElement, options: TrialType<typeof INFO>): Promise<{ found: object }> {
    const found: object = await options.show(display);
    display.replaceChildren();
    return { found };
  }
}
