/** Held-out figures of one method, as far as the model's file has them. */
export interface HeldOutRow {
  method: string;
  /** Root mean square error of a joint over whole predicted stretches, degrees. */
  errorDeg: number | null;
  /** Share of measured postures inside the 90 % band. */
  coverage: number | null;
}

/** Reads the methods' figures from a model's metrics; what is not there is left out, never made up. */
export function heldOutRows(metrics: Readonly<Record<string, unknown>> | null): HeldOutRow[] {
  const scores = metrics?.["scores"];
  if (!Array.isArray(scores)) return [];
  const number = (value: unknown) => (typeof value === "number" ? value : null);
  return scores.flatMap((score: unknown) => {
    if (typeof score !== "object" || score === null) return [];
    const figures = score as Record<string, unknown>;
    if (typeof figures["method"] !== "string") return [];
    return [
      {
        method: figures["method"],
        errorDeg: number(figures["rollout_rmse_deg"]),
        coverage: number(figures["coverage90_rollout"]),
      },
    ];
  });
}
