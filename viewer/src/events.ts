import type { State } from "./ui/state";

/** Events of the element, by name, with what they tell. */
export interface ImpastoViewerEvents {
  /** All of the first view is drawn; `first` says when there was something to look at, if only coarse. */
  "impasto-ready": CustomEvent<{ requests: number; milliseconds: number; first: number }>;
  /** The view, the light or what is shown has changed. */
  "impasto-change": CustomEvent<{ state: State; hash: string }>;
  "impasto-problem": CustomEvent<{ kind: string; where: string; detail: string }>;
  "impasto-pixel": CustomEvent<{ x: number; y: number }>;
}
