// Starts the view, or says why there is none.
function fail(text) { $("view-message").hidden = false; $("view-message").textContent = text; $("controls").hidden = true; for (const b of document.querySelectorAll("button.fly")) b.disabled = true; }

async function start() {
  gl = canvas.getContext("webgl2", { antialias: true, alpha: false, preserveDrawingBuffer: true });
  if (!gl) return fail("This browser shows no 3D (WebGL 2 is absent or switched off). Everything else on this page works; the ParaView files beside it hold the same data.");
  if (!window.DecompressionStream) { gl = null; return fail("This browser is too old to unpack the 3D data (it lacks DecompressionStream). Everything else on this page works."); }
  await unpack();
  upload();
  controls();
  pointers();
  places();
  filmControls();
  look("oblique");
  $("view-message").hidden = true;
  new ResizeObserver(redraw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // on paper stands a copy, light whatever the screen: what WebGL draws while printing does not reach the paper
  const paper = $("paper");
  window.addEventListener("beforeprint", () => {
    document.documentElement.classList.add("printing");
    draw();
    [paper.width, paper.height] = [canvas.width, canvas.height];
    paper.getContext("2d").drawImage(canvas, 0, 0);
  });
  window.addEventListener("afterprint", () => { document.documentElement.classList.remove("printing"); redraw(); });
  canvas.addEventListener("webglcontextlost", () => { gl = null; fail("The graphics driver stopped. Load the page again to see the 3D view."); });
  draw();
  document.body.dataset.view = "ready";
}

start().catch((error) => { gl = null; fail("The 3D view could not start: " + error.message); console.error(error); });
