import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import {
  hex, identityColour, packed, rgb, type Rgb, theme, unpacked,
} from '../src/draw/colours';
import { MAP_NAMES, rampColour, rampStops, rampTexels, rangeOf } from '../src/draw/ramp';

/** Relative luminance and contrast ratio, as in WCAG 2. */
function luminance(colour: Rgb): number {
  const [red, green, blue] = colour.map((part) =>
    part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

function contrast(one: Rgb, other: Rgb): number {
  const [lighter, darker] = [luminance(one), luminance(other)].sort((a, b) => b - a);
  return (lighter + 0.05) / (darker + 0.05);
}

for (const dark of [false, true]) {
  const name = dark ? 'dark' : 'light';

  test(`lines contrast with the background (${name})`, () => {
    const { background, outline, hole, accent, normal, missing } = theme(dark);
    for (const colour of [outline, hole, accent, normal, missing]) {
      assert.ok(contrast(colour, background) >= 3, hex(colour));
    }
  });

  test(`Every identity's colour stands out from the ground (${name})`, () => {
    for (let identity = 0; identity < 2000; ++identity) {
      const colour = identityColour(identity, 0, dark);
      assert.ok(contrast(colour, theme(dark).background) >= 3, `${identity}: ${hex(colour)}`);
    }
  });

  test(`attribute colours contrast, in even lightness steps (${name})`, () => {
    const shares = Array.from({ length: 33 }, (_, k) => k / 32);
    for (const map of MAP_NAMES) {
      for (const share of shares) {
        const ratio = contrast(rampColour(share, { dark, map }), theme(dark).background);
        assert.ok(ratio >= 3, `${map} ${share}: ${ratio}`);
      }
    }
    // The cube root of luminance is close to perceived lightness.
    const light = shares.map((share) => 
      Math.cbrt(luminance(rampColour(share, { dark, map: 'violet-yellow' }))));
    const steps = light.slice(1).map((one, k) => one - light[k]);
    assert.ok(Math.min(...steps) > 0.3 * Math.max(...steps), steps.join(' '));
  });
}

test('successive identities differ in colour', () => {
  const distance = (one: Rgb, other: Rgb): number =>
    Math.hypot(...one.map((part, k) => part - other[k]));
  for (let identity = 1; identity < 500; ++identity) {
    for (const other of [1, 2]) {
      const a = identityColour(identity, 0, false);
      const b = identityColour(identity + other, 0, false);
      assert.ok(distance(a, b) > 0.15, `${identity}, ${identity + other}`);
    }
  }
  assert.deepEqual(identityColour(77, 3, true), identityColour(77, 3, true));
  assert.notDeepEqual(identityColour(77, 3, true), identityColour(77, 4, true));
});

test('an untracked ring is grey', () => {
  assert.deepEqual(identityColour(0, 0, true), theme(true).missing);
  assert.notDeepEqual(identityColour(0, 1, true), theme(true).missing);
});

test('a colour converts to text and number and back', () => {
  assert.equal(hex(rgb('#0b4f86')), '#0b4f86');
  assert.equal(packed(rgb('#0b4f86')), 0xff864f0b);
  assert.equal(hex(unpacked(packed(rgb('#fa0180')))), '#fa0180');
});

test('legend stops cover the range', () => {
  const stops = rampStops({ dark: true, map: 'violet-yellow' });
  assert.equal(stops[0], hex(rampColour(0, { dark: true, map: 'violet-yellow' })));
  assert.equal(stops[stops.length - 1], hex(rampColour(1, { dark: true, map: 'violet-yellow' })));
  const texels = rampTexels(256, { dark: true, map: 'violet-yellow' });
  assert.equal(hex([texels[0] / 255, texels[1] / 255, texels[2] / 255]), stops[0]);
});

test('SVG pictures of the command line have the same colours', () => {
  const read = (name: string) => readFileSync(new URL(`../../../output/${name}`, import.meta.url), 'utf8');
  const bytes = [...read('color_map.cc').matchAll(/\{?0x(\w\w), 0x(\w\w), 0x(\w\w)\}/g)];
  assert.deepEqual(bytes.map(([, ...parts]) => `#${parts.join('')}`), rampStops({ dark: false, map: 'violet-yellow' }));
  const { interior, edge, particle, outline, isoline } = theme(false);
  for (const colour of [interior, edge, particle, outline, isoline]) {
    assert.ok(read('formats/svg.cc').includes(hex(colour)), hex(colour));
  }
});

test('a range ignores NaN and infinity', () => {
  assert.deepEqual(rangeOf(Float32Array.of(3, NaN, -1, Infinity, 2)), { min: -1, max: 3 });
  assert.equal(rangeOf(Float32Array.of(NaN)), null);
});
