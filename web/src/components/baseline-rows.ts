import { meanRula, ranked } from "../common/verdict";
import type { Candidate } from "../data/types";

/** What one method says of the chosen candidate, and the candidate it would take. */
export interface BaselineRow {
  method: string;
  rula: number | null;
  cost: number | null;
  pick: string | null;
}

/** One row per method, the predictor's own first; `pick` is the candidate of least cost under it. */
export function baselineRows(
  candidates: readonly Candidate[],
  selected: string | null,
  method: string,
): BaselineRow[] {
  const order = ranked(candidates).filter((candidate) => candidate.rank !== null);
  const chosen = order.find((candidate) => candidate.id === selected);
  const own: BaselineRow = {
    method,
    rula: chosen ? meanRula(chosen) : null,
    cost: chosen?.cost?.total ?? null,
    pick: order[0]?.id ?? null,
  };
  const others = new Set(order.flatMap((candidate) => Object.keys(candidate.baseline ?? {})));
  others.delete(method);
  return [
    own,
    ...[...others].map((name) => {
      let pick: string | null = null;
      let least = Infinity;
      for (const candidate of order) {
        const cost = candidate.baseline?.[name]?.cost_total ?? Infinity;
        if (cost < least) {
          least = cost;
          pick = candidate.id;
        }
      }
      const result = chosen?.baseline?.[name];
      return {
        method: name,
        rula: result?.rula_expected_mean ?? null,
        cost: result?.cost_total ?? null,
        pick,
      };
    }),
  ];
}
