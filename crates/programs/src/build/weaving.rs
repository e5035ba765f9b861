//! Weaves in programs: each controller's words for them, and where they stand.

use meltpath_toolpath::{Event, Pass, Weave, WeaveShape};

use super::error::BuildError;
use super::wording::Wording;
use super::{Builder, Step, moved};
use crate::fanuc_ls::weave_text;
use crate::program::{Dialect, Instruction};
use crate::weave::told;

/// Weaves that differ by less are one: Hz, mm and s.
const SAME: f64 = 1e-6;
/// Steps in which a FANUC takes frequencies, Hz, amplitudes, mm, and dwells, s.
const FANUC_STEPS: [f64; 3] = [0.1, 0.1, 0.001];

/// Why a weave has no words: what, and what to do.
type Wordless = (&'static str, &'static str);

/// The values of a weave: frequency, amplitude, dwell on the right and on the left, as FANUC tells them.
fn values(weave: &Weave) -> [f64; 4] {
    let [left, right] = weave.dwell;
    [weave.frequency, weave.amplitude, right, left]
}

fn same(a: &Weave, b: &Weave) -> bool {
    let near = |(a, b): (f64, f64)| (a - b).abs() <= SAME;
    a.shape == b.shape && values(a).into_iter().zip(values(b)).all(near)
}

impl Wording<'_> {
    /// What begins a weave.
    ///
    /// # Errors
    /// What has no words for this controller, and what to do.
    pub(super) fn weave(&self, weave: &Weave) -> Result<Instruction, Wordless> {
        let listed = self.cell.weaves.iter().find(|w| same(&w.weave(), weave));
        let number = listed.map(|w| *w.number);
        match self.dialect {
            Dialect::FanucLs => fanuc(weave, number).map(Instruction::Raw),
            Dialect::Inform => {
                let number = number.ok_or((
                    "a weave of which no condition file of the cell says the values",
                    "list the condition file that sets it in the cell file ([[program.weave]]: number, shape, frequency, amplitude, dwells)",
                ))?;
                Ok(Instruction::Raw(format!("WVON WEV#({number})")))
            }
            Dialect::Krl | Dialect::Rapid => self.by_length(weave),
            Dialect::UrScript | Dialect::Val3 => Err((
                "a weave",
                "this controller has no words of its own for it: write the programs for another one (output.programs), or plan without waam.bead.weave",
            )),
        }
    }

    /// What ends a weave.
    pub(super) fn weave_end(&self) -> Instruction {
        match self.dialect {
            Dialect::Inform => Instruction::Raw("WVOF".to_owned()),
            Dialect::Krl | Dialect::Rapid => Instruction::Weave(None),
            Dialect::FanucLs | Dialect::UrScript | Dialect::Val3 => {
                Instruction::Raw("Weave End".to_owned())
            }
        }
    }

    /// A weave that a controller is told by its length along the path.
    fn by_length(&self, weave: &Weave) -> Result<Instruction, Wordless> {
        if weave.shape != WeaveShape::Triangle {
            return Err((
                "a weave that is no zigzag",
                "weave straight from side to side: waam.bead.weave.shape = \"triangle\"",
            ));
        }
        if weave.dwell != [0.0; 2] {
            return Err((
                "a weave with dwells at its sides",
                "how they count in the length of the weave is not known for this controller: plan without dwell_left and dwell_right",
            ));
        }
        if self.dialect == Dialect::Krl
            && self
                .cell
                .krl
                .as_ref()
                .is_none_or(|k| k.weave_amplitude.is_none())
        {
            return Err((
                "a weave",
                "the cell file does not say what ArcTech's Amplitude is: write program.krl.weave_amplitude",
            ));
        }
        Ok(Instruction::Weave(Some(told(weave))))
    }
}

/// By its number where the cell lists it, else by its values.
fn fanuc(weave: &Weave, number: Option<u32>) -> Result<String, Wordless> {
    let shape = match weave.shape {
        WeaveShape::Sine => "Sine",
        WeaveShape::Circle => "Circle",
        WeaveShape::Triangle => {
            // a controller has more patterns than are written by their values here
            return number.map(|n| format!("Weave[{n}]")).ok_or((
                "a weave of this shape",
                "list a weave schedule of the controller that draws it in the cell file ([[program.weave]]), or weave a sine",
            ));
        }
    };
    if let Some(number) = number {
        return Ok(format!("Weave {shape}[{number}]"));
    }
    let [frequency, amplitude, right, left] = values(weave);
    let [hertz, mm, second] = FANUC_STEPS;
    let steps = [
        (frequency, hertz),
        (amplitude, mm),
        (right, second),
        (left, second),
    ];
    let fits = |(value, step): (f64, f64)| ((value / step).round() * step - value).abs() <= SAME;
    if !steps.into_iter().all(fits) {
        return Err((
            "a weave with more digits than its line has",
            "write the frequency in steps of 0.1 Hz, the amplitude in steps of 0.1 mm, dwells in steps of 1 ms, or list a weave schedule with these values in the cell file ([[program.weave]])",
        ));
    }
    Ok(weave_text(weave))
}

impl Builder<'_> {
    /// Refuses weaves that are not there, or have no words.
    pub(super) fn check_weaves(&self, pass: &Pass<'_>) -> Result<(), BuildError> {
        for (_, event) in pass.events() {
            let Event::Weave(number) = event;
            let Some(at) = (number as usize).checked_sub(1) else {
                continue;
            };
            let weave = self.toolpath.weaves.get(at).ok_or(BuildError::Event {
                pass: pass.place(),
                event,
            })?;
            self.wording
                .weave(weave)
                .map_err(|(what, remedy)| BuildError::Weave {
                    pass: pass.place(),
                    what,
                    dialect: self.settings.dialect.name(),
                    remedy,
                })?;
        }
        Ok(())
    }

    /// Begins or ends the weave that is on before the first move of `steps`, where that is another than the one that is on.
    pub(super) fn swing(&mut self, pass: &Pass<'_>, steps: &[Step]) {
        let Some(index) = steps.first().and_then(moved) else {
            return;
        };
        let said = pass.events().take_while(|(point, _)| *point <= index);
        let number = said.last().map_or(0, |(_, Event::Weave(number))| number);
        self.set_weave(number);
    }

    /// Weave `number` of the toolpath is on from here, from 1; 0 for none.
    pub(super) fn set_weave(&mut self, number: u32) {
        if self.weave == number {
            return;
        }
        self.weave = number;
        let at = (number as usize).checked_sub(1);
        let weave = at.and_then(|i| self.toolpath.weaves.get(i));
        // `check_weaves` has found the words
        let begins = weave.and_then(|w| self.wording.weave(w).ok());
        self.assembly
            .push(begins.unwrap_or_else(|| self.wording.weave_end()));
    }
}
