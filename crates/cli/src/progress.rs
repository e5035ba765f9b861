//! Progress: bars with time left on a terminal, plain lines elsewhere; Ctrl-C asks stages to stop; timers at the end.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use meltpath_base::Observer;

use crate::show::{Voice, line_to_stderr, progress_line, voice};

/// Watches the stages of a command.
pub(crate) struct Progress {
    cancelled: Arc<AtomicBool>,
    state: Mutex<State>,
    terminal: bool,
}

struct State {
    bar: Option<ProgressBar>,
    stages: Vec<(String, Instant)>,
    ended: Option<Instant>,
}

impl Progress {
    /// A watcher; from now on, Ctrl-C asks the running stage to stop.
    pub(crate) fn new() -> Self {
        let cancelled = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancelled);
        // without a handler Ctrl-C ends the process at once, which leaves a hidden partial folder: worth saying
        if ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).is_err() {
            line_to_stderr(
                "note: Ctrl-C cannot be handled here; a cancelled run may leave a hidden partial folder",
            );
        }
        let state = State {
            bar: None,
            stages: Vec::new(),
            ended: None,
        };
        Progress {
            cancelled,
            state: Mutex::new(state),
            terminal: voice() == Voice::Words && std::io::stderr().is_terminal(),
        }
    }

    fn with<T>(&self, f: impl FnOnce(&mut State) -> T) -> T {
        f(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Ends the last stage and removes its bar.
    pub(crate) fn finish(&self) {
        self.with(|s| {
            if let Some(bar) = s.bar.take() {
                bar.finish_and_clear();
            }
            s.ended = Some(Instant::now());
        });
    }

    /// Each stage with the time it took, in order.
    pub(crate) fn timers(&self) -> Vec<(String, Duration)> {
        self.with(|s| {
            let ends = s
                .stages
                .iter()
                .skip(1)
                .map(|(_, t)| *t)
                .chain(s.ended.or_else(|| Some(Instant::now())));
            s.stages
                .iter()
                .zip(ends)
                .map(|((name, start), end)| (name.clone(), end.duration_since(*start)))
                .collect()
        })
    }
}

impl Observer for Progress {
    fn stage(&self, name: &str, total: u64) {
        self.with(|s| {
            if let Some(bar) = s.bar.take() {
                bar.finish_and_clear();
            }
            s.stages.push((name.to_owned(), Instant::now()));
            if self.terminal {
                let bar = if total == 0 {
                    ProgressBar::new_spinner()
                } else {
                    ProgressBar::new(total)
                };
                let template = if total == 0 {
                    "{msg:24} {spinner} {elapsed}"
                } else {
                    "{msg:24} {wide_bar} {percent:>3} %  {eta} left"
                };
                if let Ok(style) = ProgressStyle::with_template(template) {
                    bar.set_style(style);
                }
                bar.set_message(name.to_owned());
                bar.enable_steady_tick(Duration::from_millis(200));
                s.bar = Some(bar);
            } else {
                progress_line(&format!("{name} …"));
            }
        });
    }

    fn advance(&self, done: u64) {
        self.with(|s| {
            if let Some(bar) = &s.bar {
                bar.inc(done);
            }
        });
    }

    fn note(&self, text: &str) {
        self.with(|s| match &s.bar {
            Some(bar) => bar.suspend(|| progress_line(text)),
            None => progress_line(text),
        });
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
