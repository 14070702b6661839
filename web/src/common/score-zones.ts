import type { Zone } from "../components/chart-series";

/** RULA's action levels (McAtamney and Corlett 1993): scores 1-2, 3-4, 5-6 and 7. */
export const RULA_ZONES: readonly Zone[] = [
  { from: 2.5, to: 4.5, colour: "--zone-2", label: "3–4 look into it" },
  { from: 4.5, to: 6.5, colour: "--zone-3", label: "5–6 change soon" },
  { from: 6.5, to: 7.5, colour: "--zone-4", label: "7 change now" },
];
export const RULA_LIMITS: [number, number] = [0.5, 7.5];
export const RULA_TICKS: number[] = [1, 3, 5, 7];

/** REBA's action levels (Hignett and McAtamney 2000): 1, 2-3, 4-7, 8-10, 11-15. */
export const REBA_ZONES: readonly Zone[] = [
  { from: 3.5, to: 7.5, colour: "--zone-2", label: "4–7 medium" },
  { from: 7.5, to: 10.5, colour: "--zone-3", label: "8–10 high" },
  { from: 10.5, to: 15.5, colour: "--zone-4", label: "11+ very high" },
];
export const REBA_LIMITS: [number, number] = [0.5, 15.5];
export const REBA_TICKS: number[] = [1, 4, 8, 11, 15];
