// Floquet multipliers: eigenvalues of a monodromy matrix, 3 by 3, whose last row is 0 where the capsule sticks.

export interface Complex {
  re: number;
  im: number;
}

export const modulus = (z: Complex): number => Math.hypot(z.re, z.im);

/** Roots of z² − trace z + determinant. */
function quadratic(trace: number, determinant: number): [Complex, Complex] {
  const half = trace / 2;
  const inside = half * half - determinant;
  if (inside < 0) return [{ re: half, im: Math.sqrt(-inside) }, { re: half, im: -Math.sqrt(-inside) }];
  const large = half + Math.sign(half || 1) * Math.sqrt(inside);
  return [{ re: large, im: 0 }, { re: large === 0 ? 0 : determinant / large, im: 0 }];
}

export type Matrix = readonly number[]; // nine numbers, row by row

const at = (m: Matrix, i: number, j: number): number => m[3 * i + j] ?? NaN;

/** Trace, sum of principal minors, and determinant. */
export function invariants(m: Matrix): [number, number, number] {
  const minor = (i: number, j: number): number => at(m, i, i) * at(m, j, j) - at(m, i, j) * at(m, j, i);
  const determinant =
    at(m, 0, 0) * minor(1, 2) -
    at(m, 0, 1) * (at(m, 1, 0) * at(m, 2, 2) - at(m, 1, 2) * at(m, 2, 0)) +
    at(m, 0, 2) * (at(m, 1, 0) * at(m, 2, 1) - at(m, 1, 1) * at(m, 2, 0));
  return [at(m, 0, 0) + at(m, 1, 1) + at(m, 2, 2), minor(0, 1) + minor(0, 2) + minor(1, 2), determinant];
}

/** All three, the largest modulus first. */
export function multipliers(m: Matrix): Complex[] {
  const sticks = m.slice(6, 9).every((value) => value === 0);
  const found: Complex[] = sticks
    ? [...quadratic(at(m, 0, 0) + at(m, 1, 1), at(m, 0, 0) * at(m, 1, 1) - at(m, 0, 1) * at(m, 1, 0)), { re: 0, im: 0 }]
    : cubic(...invariants(m));
  return found.sort((a, b) => modulus(b) - modulus(a));
}

/** Roots of z³ − a z² + b z − c: the real one by bisection and Newton's method, then the others. */
function cubic(a: number, b: number, c: number): Complex[] {
  const value = (z: number): number => ((z - a) * z + b) * z - c;
  let high = 1 + Math.max(Math.abs(a), Math.abs(b), Math.abs(c));
  let low = -high;
  for (let k = 0; k < 200 && high - low > 1e-16 * Math.abs(low + high); k++) {
    const middle = (low + high) / 2;
    if (middle === low || middle === high) break;
    if (value(middle) < 0) low = middle;
    else high = middle;
  }
  const real = (low + high) / 2;
  return [{ re: real, im: 0 }, ...quadratic(a - real, real * (real - a) + b)];
}

/** The functions that vanish at a smooth bifurcation: det(M − I), det(M + I), and the product of all 1 − μᵢμⱼ. */
export const TESTS: readonly { name: string; at: (m: Matrix) => number }[] = [
  { name: "fold", at: (m) => ((a, b, c) => 1 - a + b - c)(...invariants(m)) },
  { name: "period doubling", at: (m) => ((a, b, c) => 1 + a + b + c)(...invariants(m)) },
  { name: "Neimark-Sacker", at: (m) => ((a, b, c) => 1 - b + a * c - c * c)(...invariants(m)) },
];
