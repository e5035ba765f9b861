// What the page does without a 3D view: printing the operator sheet alone.
"use strict";
const $ = (id) => document.getElementById(id);
if ($("print-sheet")) $("print-sheet").addEventListener("click", () => {
  document.body.classList.add("sheet-only");
  window.print();
  document.body.classList.remove("sheet-only");
});
