import { LitElement, css, html } from "lit";
import { customElement, property } from "lit/decorators.js";

import { anything } from "../common/format";
import { words } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import type { Assumption } from "../data/types";

/** Inputs that were assumed rather than measured, with the range each one opens. */
@customElement("ec-assumed")
export class EcAssumed extends LitElement {
  @property({ attribute: false }) assumed: Assumption[] = [];

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
        overflow-x: auto;
      }
      table {
        border-collapse: collapse;
        width: 100%;
        font-size: 0.93rem;
      }
      th {
        text-align: left;
        font-weight: 560;
        font-size: 0.79rem;
        color: var(--ink-soft);
      }
      th,
      td {
        padding: 0.32rem 0.8rem 0.32rem 0;
        vertical-align: top;
        border-bottom: 1px solid var(--line);
        overflow-wrap: anywhere;
      }
      tr:last-child td {
        border-bottom: none;
      }
      @media (max-width: 600px) {
        thead {
          display: none;
        }
        tr {
          display: block;
          padding: 0.35rem 0;
          border-bottom: 1px solid var(--line);
        }
        td {
          display: block;
          border: none;
          padding: 0;
        }
        td[data-head]::before {
          content: attr(data-head) " ";
          color: var(--ink-soft);
          font-size: 0.86rem;
        }
      }
    `,
  ];

  override render() {
    if (this.assumed.length === 0) {
      return html`<p class="soft">Nothing: every input was given or measured.</p>`;
    }
    return html`<table>
      <thead>
        <tr>
          <th>Assumed</th>
          <th>Taken as</th>
          <th>Could be</th>
          <th>What that would change</th>
        </tr>
      </thead>
      <tbody>
        ${this.assumed.map(
          (item) =>
            html`<tr>
              <td><b>${words(item.what)}</b></td>
              <td data-head="Taken as" class="number">${anything(item.value)}</td>
              <td data-head="Could be" class="number">${anything(item.range)}</td>
              <td>${anything(item.effect)}</td>
            </tr>`,
        )}
      </tbody>
    </table>`;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-assumed": EcAssumed;
  }
}
