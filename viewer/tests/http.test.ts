import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterEach, expect, test } from "vitest";
import { HttpStore } from "../src/store/http";

const FILE = Uint8Array.from({ length: 100 }, (_, i) => i);
let server: Server | undefined;

afterEach(() => server?.close());

/** A store on a host that answers as told. */
function store(
  answer: (range: string) => { status: number; headers?: Record<string, string>; body: Uint8Array },
) {
  return new Promise<HttpStore>((resolve) => {
    server = createServer((request, response) => {
      const { status, headers, body } = answer(request.headers.range ?? "");
      response.writeHead(status, { "Content-Length": String(body.length), ...headers }).end(body);
    });
    server.listen(0, "127.0.0.1", () => {
      resolve(new HttpStore(`http://127.0.0.1:${(server!.address() as AddressInfo).port}/a.zarr`));
    });
  });
}

test("a range is a range", async () => {
  const { getRange } = await bound(
    store(() => ({ status: 206, headers: { "Content-Range": "bytes 10-14/100" }, body: FILE.slice(10, 15) })),
  );
  expect([...(await getRange({ offset: 10, length: 5 }))]).toEqual([10, 11, 12, 13, 14]);
});

test("a whole file in place of a range is cut, and never taken for the range", async () => {
  const { getRange } = await bound(store(() => ({ status: 200, body: FILE })));
  expect([...(await getRange({ offset: 10, length: 3 }))]).toEqual([10, 11, 12]);
  expect([...(await getRange({ suffixLength: 2 }))]).toEqual([98, 99]);
  await expect(getRange({ offset: 99, length: 5 })).rejects.toMatchObject({ kind: "damaged" });
});

test("another range than the one asked for is refused", async () => {
  const { getRange } = await bound(
    store(() => ({ status: 206, headers: { "Content-Range": "bytes 0-4/100" }, body: FILE.slice(0, 5) })),
  );
  await expect(getRange({ offset: 10, length: 5 })).rejects.toMatchObject({ kind: "damaged" });
});

test.each([
  [404, "missing"],
  [403, "refused"],
  [500, "refused"],
])("status %i is told as %s", async (status, kind) => {
  const opened = await store(() => ({ status, body: FILE }));
  await expect(opened.get("/c/0/0")).rejects.toMatchObject({
    kind,
    where: expect.stringContaining("/a.zarr/c/0/0"),
  });
});

async function bound(opening: Promise<HttpStore>) {
  const opened = await opening;
  return { getRange: (range: Parameters<HttpStore["getRange"]>[1]) => opened.getRange("/c/0", range) };
}
