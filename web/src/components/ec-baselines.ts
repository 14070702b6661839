import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { figure } from "../common/format";
import { methodWords } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import { meanRula, ranked } from "../common/verdict";
import type { Candidate } from "../data/types";

interface Row {
  method: string;
  rula: number | null;
  cost: number | null;
  pick: string | null;
}

/** What simpler predictors say of the same candidate, and which one each of them would pick. */
@customElement("ec-baselines")
export class EcBaselines extends LitElement {
  @property({ attribute: false }) candidates: Candidate[] = [];
  @property() selected: string | null = null;
  @property() method = "";

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
      }
      table {
        border-collapse: collapse;
        width: 100%;
      }
      th {
        font-weight: 560;
        font-size: 0.79rem;
        color: var(--ink-soft);
        text-align: right;
      }
      td {
        text-align: right;
      }
      th:first-child,
      td:first-child {
        text-align: left;
      }
      th,
      td {
        padding: 0.32rem 0 0.32rem 0.8rem;
        border-bottom: 1px solid var(--line);
      }
      th:first-child,
      td:first-child {
        padding-left: 0;
      }
      tr:last-child td {
        border-bottom: none;
      }
    `,
  ];

  override render() {
    const rows = baselineRows(this.candidates, this.selected, this.method);
    if (rows.length < 2) return html`<p class="soft">No other method was run.</p>`;
    const ours = rows[0]!.pick;
    return html`<table class="number">
      <thead>
        <tr>
          <th>Method</th>
          <th>Mean RULA</th>
          <th>Cost</th>
          <th>Would take</th>
        </tr>
      </thead>
      <tbody>
        ${rows.map(
          (row) =>
            html`<tr>
              <td>${methodWords(row.method)}</td>
              <td>${row.rula === null ? "–" : row.rula.toFixed(2)}</td>
              <td>${row.cost === null ? "–" : figure(row.cost)}</td>
              <td>
                ${row.pick ?? "–"}
                ${
                  row.pick !== null && row.pick !== ours
                    ? html`<span class="tag warn">differs</span>`
                    : nothing
                }
              </td>
            </tr>`,
        )}
      </tbody>
    </table>`;
  }
}

/** One row per method, the predictor's own first; `pick` is the candidate of least cost under it. */
export function baselineRows(
  candidates: readonly Candidate[],
  selected: string | null,
  method: string,
): Row[] {
  const order = ranked(candidates).filter((candidate) => candidate.rank !== null);
  const chosen = order.find((candidate) => candidate.id === selected);
  const own: Row = {
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

declare global {
  interface HTMLElementTagNameMap {
    "ec-baselines": EcBaselines;
  }
}
