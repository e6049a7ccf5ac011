/** The address of the page with what is shown. */

import type { Problems } from "./problems";

const COPIED_MS = 2500;

/** Copies it, or shows it where the browser does not allow that. */
export async function copyAddress(hash: string, problems: Problems): Promise<void> {
  const url = new URL(location.href);
  url.hash = hash;
  try {
    await navigator.clipboard.writeText(url.href);
    problems.say(problems.messages.copied, COPIED_MS);
  } catch {
    problems.say(url.href);
  }
}
