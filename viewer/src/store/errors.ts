/** What went wrong with a store. The page has a message for each kind, and shows what and where. */
export type ProblemKind =
  | "unreachable" // no answer: wrong address, no network, or the host does not allow other pages (CORS)
  | "missing" // 404
  | "refused" // another status
  | "not-a-store"
  | "newer"
  | "damaged"
  | "no-ranges"
  | "unsupported";

export class StoreProblem extends Error {
  constructor(
    readonly kind: ProblemKind,
    readonly where: string,
    readonly detail = "",
  ) {
    super(`${kind}: ${where}${detail && `: ${detail}`}`);
    this.name = "StoreProblem";
  }
}

export function isAbort(error: unknown): boolean {
  for (let cause = error; cause instanceof Error; cause = cause.cause) {
    if (cause.name === "AbortError") return true;
  }
  return false;
}

/** The store's own problem behind an error, which libraries wrap; anything else counts as damage at `where`. */
export function asProblem(error: unknown, where: string): StoreProblem {
  for (let cause = error; cause instanceof Error; cause = cause.cause) {
    if (cause instanceof StoreProblem) return cause;
  }
  return new StoreProblem("damaged", where, error instanceof Error ? error.message : String(error));
}
