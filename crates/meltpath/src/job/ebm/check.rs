//! Values of an electron-beam job that contradict each other, each with its place and what to do.

use meltpath_base::settings::{Problem, broken};

use super::rings;
use super::{ChartPreview, CorrectTable, EbmJob, Ground, JudgeSolver, LayerMemory, OptimiseSolver};

/// Layers of a toolpath that have names.
const MOST_LAYERS: u32 = 16_383;

impl EbmJob {
    /// Values that contradict each other.
    pub(in crate::job) fn check(&self) -> Vec<Problem> {
        let mut found = self.check_beam();
        found.extend(self.check_part());
        found.extend(rings::check(&self.region));
        found.extend(self.check_window());
        found.extend(self.optimise.iter().flat_map(|o| self.check_optimise(o)));
        found.extend(self.check_preview());
        found.extend(self.correct.iter().flat_map(|c| self.check_correct(c)));
        found.extend(self.check_between());
        let judge = &self.judge;
        if judge.depth.is_some_and(|depth| depth.0 > self.ebm.layer.0) {
            let help = "read within the last layer: leave it out for the middle of the layer";
            let problem = judge.depth.problem("judge.depth lies below the last layer");
            found.push(problem.help(help));
        }
        let part = &judge.part;
        if let Some([a, b]) = part.value
            && (0..2).any(|n| a[n].0 >= b[n].0)
        {
            let help = "write its lower left corner, then its upper right one";
            found.push(part.problem("judge.part has no area").help(help));
        }
        found
    }

    /// What happens between layers, where there is nothing between them.
    fn check_between(&self) -> Vec<Problem> {
        let judge = &self.judge;
        let single = *self.ebm.layers == 1;
        let cold = !single && *judge.memory == LayerMemory::Metal;
        let one = |key: Problem| {
            key.help("write how many layers are drawn (ebm.layers), or leave it out")
        };
        let none = |key: Problem| key.help("leave one of them out");
        let of_one = "is of several layers, and ebm.layers is 1";
        let of_heat = "is of layers that keep heat, and judge.memory is \"metal\"";
        let (powder, between, memory) = (&judge.powder, &judge.between, &judge.memory);
        broken([
            (
                single && powder.is_written(),
                one(powder.problem(format!("judge.powder {of_one}"))),
            ),
            (
                single && between.is_written(),
                one(between.problem(format!("judge.between {of_one}"))),
            ),
            (
                single && memory.is_written(),
                one(memory.problem(format!("judge.memory {of_one}"))),
            ),
            (
                cold && powder.is_written(),
                none(powder.problem(format!("judge.powder {of_heat}"))),
            ),
            (
                cold && between.is_written(),
                none(between.problem(format!("judge.between {of_heat}"))),
            ),
        ])
    }

    /// Without charts the solver does it all.
    fn check_preview(&self) -> Vec<Problem> {
        let preview = &self.charts.preview;
        let none = **preview == Some(ChartPreview::None);
        let on_charts = self.search() == Some(OptimiseSolver::Charts);
        broken([
            (
                none && *self.judge.solver == JudgeSolver::None,
                preview
                    .problem(
                        "charts.preview and judge.solver are both \"none\": nothing draws the path",
                    )
                    .help("leave one of them out"),
            ),
            (
                none && on_charts,
                preview
                    .problem(
                        "[optimise] takes temperatures from charts, and charts.preview is \"none\"",
                    )
                    .help("write solver = \"judge\" under [optimise], or leave charts.preview out"),
            ),
            (
                none && !self.charts.files.is_empty(),
                self.charts
                    .files
                    .problem("charts.files are not used: charts.preview is \"none\"")
                    .help("leave charts.files or charts.preview out"),
            ),
        ])
    }

    fn check_correct(&self, correct: &CorrectTable) -> Vec<Problem> {
        let [least, most] = *correct.currents;
        broken([
            (
                *self.judge.solver == JudgeSolver::None,
                self.correct
                    .problem("[correct] draws on the solver of [judge], which is \"none\"")
                    .help("leave judge.solver or [correct] out"),
            ),
            (
                *correct.rounds == 0 && *correct.finest == 0,
                correct
                    .rounds
                    .problem("correct.rounds and correct.finest are both 0: nothing is corrected")
                    .help("leave one of them out, or [correct]"),
            ),
            (
                least.0 >= most.0,
                correct
                    .currents
                    .problem("correct.currents leave nothing to change")
                    .help("write the least share first, such as [\"30 %\", \"200 %\"]"),
            ),
        ])
    }

    fn check_beam(&self) -> Vec<Problem> {
        let (ebm, region) = (&self.ebm, &self.region);
        let hatched = self.hatch.is_written();
        let supported = region.supported.is_written() && !self.part.is_written();
        let overruns = self
            .hatch
            .as_ref()
            .map(|h| &h.overrun)
            .filter(|o| o.is_written());
        broken([
            (
                ebm.focus.is_written() && ebm.diameter.is_written(),
                ebm.diameter
                    .problem("ebm.focus and ebm.diameter both say how wide the beam is")
                    .help("keep one of them"),
            ),
            (
                hatched && *ebm.layers > MOST_LAYERS,
                ebm.layers
                    .problem(format!("ebm.layers is {}: [hatch] draws {MOST_LAYERS} layers at most", *ebm.layers))
                    .help("draw the last of them: a few show whether the last one is as hot as the one before"),
            ),
            (
                self.path.is_written() == hatched,
                self.path
                    .problem("the beam needs either `path` or the table [hatch]")
                    .help("name a file of the beam's path, or let [hatch] draw the region"),
            ),
            (
                self.modulation.is_written() && overruns.is_some(),
                Problem::new("hatch.overrun draws beyond the contour, where [modulation] has no energy to give")
                    .at(overruns.and_then(|o| o.span.clone()))
                    .help("keep one of them"),
            ),
            (
                self.modulation.is_written() && !hatched,
                self.modulation
                    .problem("[modulation] changes what [hatch] draws, which is not there")
                    .help("let [hatch] draw the region"),
            ),
            (
                supported && *ebm.ground != Ground::Powder,
                region
                    .supported
                    .problem("region.supported says where metal lies below, and ebm.ground does already")
                    .help("write ground = \"powder\" under [ebm], or leave region.supported out"),
            ),
            (
                *ebm.ground == Ground::Cake && !region.contour.is_written() && !self.part.is_written(),
                ebm.ground
                    .problem("the ground is metal below the region and powder beside it, and no region is written")
                    .help("give the corners of the region: contour = [[\"0 mm\", \"0 mm\"], …] under [region]"),
            ),
            (
                hatched && !region.contour.is_written() && !self.part.is_written(),
                self.hatch
                    .problem("[hatch] has nothing to fill")
                    .help("name a part: part = \"bracket.step\", or give the corners of the region: contour = [[\"0 mm\", \"0 mm\"], …] under [region]"),
            ),
        ])
    }

    /// A part gives its own region and ground.
    fn check_part(&self) -> Vec<Problem> {
        let region = &self.region;
        let powder = Some(&self.ebm.ground.span).filter(|_| *self.ebm.ground != Ground::Metal);
        let spans = [
            &region.contour.span,
            &region.holes.span,
            &region.supported.span,
        ];
        let again = spans.into_iter().chain(powder).flatten().next().cloned();
        let part = self.part.is_written();
        broken([
            (
                !part && self.section.says_something(),
                self.section
                    .problem("[section] cuts a part, and none is named")
                    .help("write part = \"bracket.step\" at the top of the job"),
            ),
            (
                part && !self.hatch.is_written(),
                self.part
                    .problem("a part is drawn by [hatch], which is not there")
                    .help("write [hatch], with nothing in it for lines as they are by default"),
            ),
            (
                part && again.is_some(),
                Problem::new("the part says what is drawn and where metal lies below; region.contour, region.holes, region.supported or ebm.ground says it again")
                    .at(again)
                    .help("leave them out, or leave the part out"),
            ),
        ])
    }

    fn check_window(&self) -> Vec<Problem> {
        let w = &self.window;
        let limits = w.low.is_written() || w.high.is_written();
        broken([
            (
                w.body.is_written() && (w.good.is_written() || !self.hatch.is_written()),
                w.body
                    .problem("window.body is drawn by [hatch], and takes the place of window.good")
                    .help("write [hatch], or name a path as window.good"),
            ),
            (
                w.body.is_written() && limits,
                w.body
                    .problem("window.body and window.low or window.high both place the window")
                    .help("keep window.body with window.width, or the two limits"),
            ),
            (
                w.good.is_written() && limits,
                w.good
                    .problem("window.good and window.low or window.high both place the window")
                    .help("keep window.good with window.width, or the two limits"),
            ),
            (
                w.low.value >= w.high.value,
                Problem::new(format!(
                    "the window's lower limit, {}, is not below its upper one, {}",
                    *w.low, *w.high
                ))
                .at(w.low.span.clone().or(w.high.span.clone()))
                .help("write both window.low and window.high, the lower one as low"),
            ),
        ])
    }
}
