/** The benchmark's table: filters, sorting, and names that put their run into the replay. */

import { choose, state } from "./state.js";

export function startTable() {
  const table = document.getElementById("benchmark-table");
  if (table) {
    connectFilters(table);
    connectSorting(table);
  }
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button[data-run]");
    if (!button) return;
    choose(button.dataset.run, event.shiftKey ? state.keys[0] : null);
    document.getElementById("replay").scrollIntoView();
  });
}

function connectFilters(table) {
  const filters = [...document.querySelectorAll("#filters select")];
  const apply = () => {
    const wanted = Object.fromEntries(filters.map(({ name, value }) => [name, value]));
    let count = 0;
    for (const row of table.tBodies[0].rows) {
      row.hidden = filters.some(({ name }) => wanted[name] && row.dataset[name] !== wanted[name]);
      count += row.hidden ? 0 : 1;
    }
    document.getElementById("filtered").textContent = `${count} rows`;
  };
  filters.forEach((filter) => filter.addEventListener("change", apply));
  apply();
}

function connectSorting(table) {
  const heads = [...table.tHead.rows[0].cells];
  const valueOf = (row, index) => row.cells[index].dataset.value ?? row.cells[index].textContent;
  const compare = (a, b) => {
    // Empty cells stand last.
    if (a === "" || b === "") return a === b ? 0 : a === "" ? Infinity : -Infinity;
    const difference = Number(a) - Number(b);
    return Number.isNaN(difference) ? a.localeCompare(b) : difference;
  };
  heads.forEach((head, index) => {
    head.querySelector("button").addEventListener("click", () => {
      const direction = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
      const rows = [...table.tBodies[0].rows];
      rows.sort((one, other) => {
        const order = compare(valueOf(one, index), valueOf(other, index));
        return Number.isFinite(order) ? direction * order : order;
      });
      table.tBodies[0].append(...rows);
    });
  });
}
