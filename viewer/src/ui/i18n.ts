/** Messages in the languages there are; English is what the others translate. */

import { de } from "../messages/de";
import { en } from "../messages/en";

export type Messages = typeof en;

const LANGUAGES: Record<string, Messages> = { en, de };

/** Returns the messages of the first language that is known, in the order given. */
export function messagesFor(languages: readonly string[]): Messages {
  for (const language of languages) {
    const found = LANGUAGES[language.toLowerCase().split("-")[0]!];
    if (found) return found;
  }
  return en;
}
