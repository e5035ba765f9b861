//! A head by its data sheet, by the words of the book alone.

use crate::support::says;
use std::fs;
use std::path::Path;

use super::{refused, run};

/// The head of the how-to.
fn head() -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/how-to/own-scan-head.md");
    let page = fs::read_to_string(page).unwrap();
    let after = page.split("### By its data sheet").nth(1).unwrap();
    let block = after.split("```toml\n").nth(1).unwrap();
    block.split("```").next().unwrap().to_owned()
}

fn job(more: &str) -> String {
    format!(
        "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"mine.toml\"\nrecipes = [\"uniform\"]\ndelays = \"recipe\"\n{more}[plate]\nblock = [1, 1]\n"
    )
}

/// Outcome and reason of the check of contours.
fn contours(out: &Path) -> (String, String) {
    let text = fs::read_to_string(out.join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&text).unwrap();
    let checks = verdict["checks"].as_array().unwrap();
    let check = checks.iter().find(|c| c["id"] == "contour-1").unwrap();
    let told = |key: &str| check[key].as_str().unwrap_or_default().to_owned();
    (told("status"), told("reason"))
}

/// What the data sheet leaves out decides whether good contours can be told; bad ones fail either way.
#[test]
fn a_head_by_its_data_sheet_promises_no_more_than_it_knows() {
    let dir = tempfile::tempdir().unwrap();
    let head = head();
    let lines = head.lines().filter(|l| !l.starts_with("left_out"));
    let unknown = lines.collect::<Vec<_>>().join("\n");
    assert_ne!(head, unknown);
    fs::write(dir.path().join("mine.toml"), &head).unwrap();
    assert_eq!(contours(&run(dir.path(), "known", &job(""))).0, "pass");
    let strict = job("") + "[checks]\ncontour_error = \"1 µm\"\ncontour_share = \"99.99 %\"\n";
    assert_ne!(contours(&run(dir.path(), "strict", &strict)).0, "pass");
    fs::write(dir.path().join("mine.toml"), unknown).unwrap();
    let (status, reason) = contours(&run(dir.path(), "unknown", &job("")));
    assert_eq!(status, "cannot-say");
    assert!(reason.contains("data sheet"), "{reason}");
    assert_eq!(contours(&run(dir.path(), "still", &strict)).0, "fail");
    for needs_a_motor in ["controller = \"h-infinity\"\n", "path = \"preview\"\n"] {
        let told = refused(dir.path(), &job(needs_a_motor));
        says(&told, &["data sheet alone", "[x] and [y]"]);
    }
}
