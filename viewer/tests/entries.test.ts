import { existsSync } from "node:fs";
import { expect, test } from "vitest";
import config from "../vite.config";

test("every entry is there", () => {
  const input = Object.values(config.build!.rolldownOptions!.input as Record<string, string>);
  expect(input.filter((path) => !existsSync(path))).toEqual([]);
});
