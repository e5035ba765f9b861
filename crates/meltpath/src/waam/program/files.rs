//! Files of programs: which of a folder is the main one, and all that it calls, read.

use std::path::{Path, PathBuf};

use meltpath_base::{Place, Reporter};
use meltpath_programs::program::Instruction;
use meltpath_programs::shared_frames::agree;
use meltpath_programs::{CellProgramming, Dialect, ParseError, Parsed, Program, dialect, val3};

use crate::waam::program::{ProgramStageError, burns};

/// The main program at `path`: itself, or the one in a folder that no other calls.
///
/// # Errors
/// [`ProgramStageError`] where a folder has none or several.
pub(crate) fn main_of(path: &Path, cell: &CellProgramming) -> Result<PathBuf, ProgramStageError> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let io = |source| ProgramStageError::Io {
        path: path.to_path_buf(),
        source,
    };
    let mut files: Vec<PathBuf> = std::fs::read_dir(path)
        .map_err(io)?
        .flatten()
        .map(|e| e.path())
        .filter(|p| is_program(p))
        .collect();
    files.sort();
    let mut programs = Vec::new();
    for file in &files {
        programs.push(parse_file(file, cell)?);
    }
    let calls_of = |file: &[Parsed], program: &Parsed| {
        let mut all = file.iter().flat_map(|p| calls(&p.program));
        all.any(|name| program.program.name.eq_ignore_ascii_case(name))
    };
    // what a file's own routines call of its others, its first apart, makes no other program of it
    let is_called = |i: usize| {
        let own: &[Parsed] = &programs[i];
        let others = programs.iter().enumerate().filter(|(j, _)| *j != i);
        let mut others = others.flat_map(|(_, file)| own.iter().map(move |p| (file, p)));
        own.first().is_some_and(|first| calls_of(own, first))
            || others.any(|(file, program)| calls_of(file, program))
    };
    let acts = |p: &Parsed| {
        let mut all = p.program.instructions.iter();
        calls(&p.program).next().is_some() || all.any(|i| matches!(i, Instruction::Motion(_)))
    };
    // one that neither moves nor calls, such as what runs at a stop, is nobody's main
    let mains: Vec<usize> = (0..files.len())
        .filter(|&i| !is_called(i))
        .filter(|&i| files.len() == 1 || programs[i].iter().any(acts))
        .collect();
    match mains[..] {
        [main] => Ok(files.swap_remove(main)),
        _ => Err(ProgramStageError::Folder {
            path: path.to_path_buf(),
            found: mains
                .iter()
                .filter_map(|&i| programs[i].first())
                .map(|p| p.program.name.clone())
                .collect(),
        }),
    }
}

/// Whether a file is a program by its name.
fn is_program(path: &Path) -> bool {
    dialect_of(path).is_some()
}

fn dialect_of(path: &Path) -> Option<Dialect> {
    Dialect::of_extension(&path.extension()?.to_string_lossy())
}

/// The programs of a file, with the data beside it, the main one first.
pub(crate) fn parse_file(
    path: &Path,
    cell: &CellProgramming,
) -> Result<Vec<Parsed>, ProgramStageError> {
    let open = |path: &Path| {
        std::fs::read(path).map_err(|source| ProgramStageError::Io {
            path: path.to_path_buf(),
            source,
        })
    };
    let dialect = dialect_of(path).unwrap_or(Dialect::FanucLs);
    let data = match (dialect.companion(), path.file_stem()) {
        (Some(ending), Some(name)) => {
            let own = find_beside(path, &format!("{}.{ending}", name.to_string_lossy()));
            own.or_else(|| (dialect == Dialect::Val3).then(|| only_beside(path, ending))?)
        }
        _ => None,
    };
    let data = data.map(|path| open(&path)).transpose()?;
    let refused = |source| ProgramStageError::Parse {
        path: path.to_path_buf(),
        source,
    };
    if dialect == Dialect::Val3 {
        for project in beside_ending(path, "pjx") {
            if val3::in_inches(&open(&project)?) {
                return Err(refused(ParseError::InInches));
            }
        }
    }
    let known = dialect_of(path).is_some();
    dialect::read(dialect, &open(path)?, data.as_deref(), cell).map_err(|error| {
        refused(match error {
            ParseError::NotAProgram if !known => ParseError::Unknown,
            error => error,
        })
    })
}

/// Reads a main program and the programs that it calls, to any depth, which lie beside it; with their files.
///
/// Sections that nothing here models are kept, and listed as warnings; lines are classed when the program is executed.
///
/// # Errors
/// [`ProgramStageError`].
pub(crate) fn read(
    main: &Path,
    cell: &CellProgramming,
    reporter: &Reporter,
) -> Result<(Vec<Program>, Vec<PathBuf>), ProgramStageError> {
    let (mut programs, mut files) = (Vec::new(), Vec::new());
    let mut waiting = vec![main.to_path_buf()];
    while let Some(path) = waiting.pop() {
        let all = parse_file(&path, cell)?;
        let calls_of = |p: &Parsed| calls(&p.program).map(str::to_owned).collect::<Vec<_>>();
        let called: Vec<String> = all.iter().flat_map(calls_of).collect();
        for parsed in &all {
            tell(parsed, &path, reporter);
        }
        programs.extend(all.into_iter().map(|p| p.program));
        for called in &called {
            let known = programs
                .iter()
                .any(|p: &Program| p.name.eq_ignore_ascii_case(called));
            if !known
                && let Some(beside) = beside(&path, called)
                && !waiting.contains(&beside)
                && !files.contains(&beside)
                && beside != path
            {
                waiting.push(beside);
            }
        }
        files.push(path);
    }
    for program in never_run(&programs) {
        reporter.warn(
            "program-not-called",
            format!(
                "{} starts the arc, and nothing that runs from {} on calls it: what it lays is not simulated",
                program.name, programs[0].name
            ),
            "name it where the program begins, or take it out of the file",
        );
    }
    agree(&mut programs);
    Ok((programs, files))
}

/// The programs with an arc that the first one does not come to by calls.
fn never_run(programs: &[Program]) -> Vec<&Program> {
    let mut run: Vec<&Program> = programs.first().into_iter().collect();
    let mut at = 0;
    while let Some(program) = run.get(at) {
        let called: Vec<&str> = calls(program).collect();
        let known: Vec<&str> = run.iter().map(|p| &*p.name).collect();
        let is_new = |p: &&Program| {
            let is = |name: &&str| p.name.eq_ignore_ascii_case(name);
            called.iter().any(is) && !known.iter().any(is)
        };
        let new: Vec<&Program> = programs.iter().filter(is_new).collect();
        run.extend(new);
        at += 1;
    }
    let runs = |p: &&Program| run.iter().any(|r| r.name.eq_ignore_ascii_case(&p.name));
    programs.iter().filter(|p| burns(p) && !runs(p)).collect()
}

/// Warns of what stands outside the instructions of a program.
fn tell(parsed: &Parsed, path: &Path, reporter: &Reporter) {
    let instruction = |line: &u32| parsed.lines.binary_search(line).is_ok();
    for unread in parsed.unread.iter().filter(|u| !instruction(&u.line)) {
        let place = Place {
            file: Some(path.display().to_string()),
            line: Some(unread.line),
            ..Place::default()
        };
        reporter.warn_at(
            "program-line-kept",
            format!(
                "\"{}\" stands outside the instructions and is kept, not executed",
                unread.text.trim()
            ),
            place,
            "",
        );
    }
}

/// The programs that a program calls, conditional calls included.
fn calls(program: &Program) -> impl Iterator<Item = &str> {
    program.instructions.iter().filter_map(|i| match i {
        Instruction::Call { program, .. } => Some(program.as_str()),
        Instruction::Raw(text) => {
            let at = text.to_ascii_uppercase().find("CALL ")?;
            let name = text.get(at + 5..)?.trim_start();
            let part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            let end = name.find(|c| !part(c)).unwrap_or(name.len());
            (end > 0).then(|| &name[..end])
        }
        _ => None,
    })
}

/// The file of program `name` beside `path`.
fn beside(path: &Path, name: &str) -> Option<PathBuf> {
    let ending = path.extension()?.to_string_lossy();
    find_beside(path, &format!("{name}.{ending}"))
}

/// The file called `wanted` beside `path`, whatever the case of its name.
fn find_beside(path: &Path, wanted: &str) -> Option<PathBuf> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|e| e.path())
        .find(|p| {
            p.file_name()
                .is_some_and(|n| n.to_string_lossy().eq_ignore_ascii_case(wanted))
        })
}

/// The only file beside `path` that ends so: a project's data may be called after the project.
fn only_beside(path: &Path, ending: &str) -> Option<PathBuf> {
    let mut found = beside_ending(path, ending);
    (found.len() == 1).then(|| found.swap_remove(0))
}

/// The files beside `path` that end so, in any case.
fn beside_ending(path: &Path, ending: &str) -> Vec<PathBuf> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let files = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
    let same = |p: &PathBuf| {
        p.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case(ending))
    };
    let files = files.into_iter().flatten().flatten();
    files.map(|e| e.path()).filter(same).collect()
}
