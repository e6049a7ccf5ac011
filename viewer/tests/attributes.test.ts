import { expect, test } from "vitest";
import { checked } from "../src/store/attributes";

const column = (name: string) => ({ name, component: 0, transfer: "linear", scale: 1, offset: 0 });
const model = {
  name: "lambert",
  base: "lambert",
  lobes: 0,
  parameters: [column("normal"), column("diffuse")],
  quality: [],
  index_of_refraction: 1.5,
  fresnel: "facet",
  light_rgb: [1],
};
const store = {
  impasto_published: 1,
  size: [4, 5],
  levels: 1,
  camera: { view_direction: [0, 0, 1], distance_mm: null, mm_per_px: 0.1 },
  light_rgb: [1],
  display: { matrix: [[1], [1], [1]] },
  models: [model],
  photographs: null,
};

test("a whole store is taken as it is", () => {
  expect(checked(store, "here")).toEqual(store);
});

test.each([
  ["camera", { camera: undefined }],
  ["camera", { camera: { ...store.camera, view_direction: [0, 0] } }],
  ["camera", { camera: { ...store.camera, distance_mm: -1 } }],
  ["camera", { camera: { ...store.camera, mm_per_px: "wide" } }],
  ["models: lambert", { models: [{ ...model, index_of_refraction: null }] }],
  ["models: lambert", { models: [{ ...model, fresnel: "none" }] }],
  ["models: lambert", { models: [{ ...model, light_rgb: [1, 1] }] }],
])("%s that pictures would be wrong with is told: %j", (detail, damage) => {
  expect(() => checked({ ...store, ...damage }, "here")).toThrow(
    expect.objectContaining({ kind: "damaged", detail }),
  );
});
