"use strict";
// The fleet's page keeps itself up to date: it asks for itself again and puts the new main part in the old one's place.

const AGAIN_MS = 2000;
const connection = document.getElementById("connection");

function where(element) {
  return element && element.id && document.querySelector("main").contains(element) ? element.id : null;
}

async function renew() {
  try {
    const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const fresh = page.querySelector("main");
    const old = document.querySelector("main");
    if (fresh && fresh.innerHTML !== old.innerHTML) {
      const focus = where(document.activeElement);
      old.replaceWith(document.adoptNode(fresh));
      if (focus && document.getElementById(focus)) document.getElementById(focus).focus();
      document.title = page.title;
    }
    connection.textContent = answer.ok ? "live" : "the database does not answer";
  } catch {
    connection.textContent = "no connection: what is shown is old; trying again";
  }
  setTimeout(renew, AGAIN_MS);
}

// j and k, or the arrows, go from cell to cell.
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const step = { j: 1, ArrowDown: 1, k: -1, ArrowUp: -1 }[event.key];
  const rows = [...document.querySelectorAll("main [data-row]")];
  if (!step || !rows.length) return;
  const at = rows.indexOf(document.activeElement);
  const next = rows[Math.min(rows.length - 1, Math.max(0, at < 0 ? 0 : at + step))];
  next.focus();
  event.preventDefault();
});

if (document.body.dataset.live === "yes") window.addEventListener("load", () => setTimeout(renew, AGAIN_MS));
else connection.textContent = "";
