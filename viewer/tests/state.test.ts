import { expect, test } from "vitest";
import { padded } from "../src/gl/tiles";
import { fromPlace, ontoArm, toPlace } from "../src/ui/hemisphere";
import { angles, direction, shaderLights, solve } from "../src/ui/lights";
import { crc32 } from "../src/ui/snapshot";
import { FIRST_LIGHT, fromHash, initialState, toHash } from "../src/ui/state";

const SRGB = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

test("an address brings back what it was made from", () => {
  const state = {
    ...initialState("phong"),
    show: "quality:residual_rms:0",
    compare: "photograph:3",
    swipe: 0.25,
    lights: [FIRST_LIGHT, { ...FIRST_LIGHT, zenith: 12.5, distance_mm: 400, size_deg: 3, kelvin: 3200 }],
    active: 1,
    exposure: -1.5,
    view: { x: 120.25, y: 33, scale: 0.125 },
  };
  expect(fromHash(`#${toHash(state)}`, initialState("other"))).toEqual(state);
});

test("an address from elsewhere cannot ask for what makes no sense", () => {
  const state = fromHash("#light=1e9,nan;95,0&exposure=-99&view=0,0,-1&show=<script>", initialState("phong"));
  expect(state.lights).toEqual([{ ...FIRST_LIGHT, zenith: 89, azimuth: 0 }]);
  expect(state.exposure).toBe(-6);
  expect(state.view).toBeNull();
  expect(state.show).toBe("radiance");
});

test("places on the hemisphere are directions and the reverse", () => {
  const { zenith, azimuth } = fromPlace(...toPlace(50, -130));
  expect(zenith).toBeCloseTo(50);
  expect(azimuth).toBeCloseTo(-130);
  expect(angles(direction(33, 77))).toEqual({ zenith: expect.closeTo(33), azimuth: expect.closeTo(77) });
  expect(ontoArm(40, 90).zenith).toBeCloseTo(0);
  expect(ontoArm(40, 170).azimuth).toBe(180);
});

test("a light of finite size has the light of a small one, from around the same place", () => {
  const lights = shaderLights([{ ...FIRST_LIGHT, size_deg: 10, intensity: 3 }], SRGB);
  expect(lights.length).toBe(16);
  expect(lights.reduce((sum, light) => sum + light.colour[1], 0)).toBeCloseTo(3);
  const centre = direction(FIRST_LIGHT.zenith, FIRST_LIGHT.azimuth);
  for (const { place } of lights) {
    const cosine = place.reduce((sum, value, i) => sum + value * centre[i]!, 0);
    expect((Math.acos(cosine) * 180) / Math.PI).toBeLessThan(5.001);
  }
});

test("a warm light is redder, and daylight is white", () => {
  const [day] = shaderLights([FIRST_LIGHT], SRGB);
  expect(day!.colour).toEqual([1, 1, 1]);
  const [warm] = shaderLights([{ ...FIRST_LIGHT, kelvin: 2856 }], SRGB);
  const [red, green, blue] = warm!.colour;
  expect(0.2126 * red + 0.7152 * green + 0.0722 * blue).toBeCloseTo(1);
  expect(red).toBeGreaterThan(1.5);
  expect(blue).toBeLessThan(0.5);
});

test("a system of equations is solved", () => {
  const matrix = [
    [2, 1, 0],
    [0, 3, 1],
    [1, 0, 4],
  ];
  // By hand: x = 1, y = 2, z = 3.
  expect(solve(matrix, [4, 9, 13])).toEqual([expect.closeTo(1), expect.closeTo(2), expect.closeTo(3)]);
});

test("codes are padded to groups of four", () => {
  expect([...padded(Uint16Array.of(1, 2, 3, 4, 5, 6), 3, new Uint16Array(8))]).toEqual([
    1, 2, 3, 0, 4, 5, 6, 0,
  ]);
});

test("the checksum of PNG is that of its standard", () => {
  expect(crc32(new TextEncoder().encode("IEND"))).toBe(0xae426082);
});
