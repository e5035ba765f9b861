"""Mutants of Rust files, and a text that holds many of them at once, each behind a switch: so that one build serves them all.

The changes are those of cargo-mutants, by the same names, but for what is computed while compiling (constants), which no switch
can reach, and the inside of macros.
"""

import dataclasses, itertools, re
import tree_sitter, tree_sitter_rust

PARSER = tree_sitter.Parser(tree_sitter.Language(tree_sitter_rust.language()))
OPERATORS = {
    "+": "- *", "-": "+ /", "*": "+ /", "/": "% *", "%": "/ +", "==": "!=", "!=": "==", "<": "== > <=", ">": "== < >=",
    "<=": ">", ">=": "<", "&&": "||", "||": "&&", "&": "| ^", "|": "& ^", "^": "| &", "<<": ">>", ">>": "<<",
}
OPERATORS |= {f"{op}=": " ".join(f"{o}=" for o in OPERATORS[op].split()) for op in "+ - * / % & | ^ << >>".split()}
NUMBERS = {"f32", "f64", *(f"{s}{n}" for s in "iu" for n in ("8", "16", "32", "64", "128", "size"))}
# what no switch can reach, or what is tested and not a test
LEFT_OUT = {"const_item", "static_item", "macro_invocation", "macro_definition", "array_type", "type_arguments", "attribute_item"}


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One change: of the operator, guard, arm or body that `node` (its kind, first and last byte) is."""

    file: str
    line: int
    column: int
    text: str  # of the line
    change: str
    node: tuple
    new: str

    @property
    def name(self):
        return f"{self.file}:{self.line}:{self.column}: {self.change}"

    @property
    def key(self):
        """File, text of the line, change: what stays when lines move."""
        return self.file, self.text, self.change


def place(node):
    # the operators of a chain begin at one byte
    return node.type, node.start_byte, node.end_byte


def text(node):
    return re.sub(r"\s+", " ", node.text.decode())


def marked(node, *words):
    """Whether an attribute with one of some words stands before an item."""
    before = node.prev_named_sibling
    while before is not None and before.type in ("attribute_item", "line_comment"):
        if before.type == "attribute_item" and any(re.search(rf"\b{word}\b", text(before)) for word in words):
            return True
        before = before.prev_named_sibling
    return False


def inner(type_text):
    """The arguments of a generic type."""
    inside, depth, parts = type_text[type_text.index("<") + 1 : type_text.rindex(">")], 0, [""]
    for c in inside:
        depth += (c in "<([") - (c in ">)]")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    return [part.strip() for part in parts]


def values(returned):
    """What a function may return instead: values of its type."""
    head = returned.split("<")[0].split("::")[-1].strip()
    if returned in ("", "()"):
        return ["()"]
    if returned == "bool":
        return ["true", "false"]
    if returned in NUMBERS:
        one = "1.0" if returned[0] == "f" else "1"
        zero = "0.0" if returned[0] == "f" else "0"
        return [zero, one] + ([f"-{one}"] if returned[0] != "u" else [])
    if returned == "String":
        return ["String::new()", '"xyzzy".into()']
    if returned in ("&str", "&'static str"):
        return ['""', '"xyzzy"']
    if head in ("Option", "Vec", "Result", "Box") and "<" in returned:
        some = values(inner(returned)[0])
        if head == "Option":
            return ["None"] + [f"Some({v})" for v in some]
        if head == "Vec":
            return ["vec![]"] + [f"vec![{v}]" for v in some]
        return [f"{'Ok' if head == 'Result' else 'Box::new'}({v})" for v in some]
    if returned.startswith("[") and ";" in returned:
        kind, size = returned[1:-1].rsplit(";", 1)
        return [f"[{v};{size}]" for v in values(kind.strip())]
    if head == "Result":
        return ["Ok(Default::default())"]
    if returned.startswith("(") and not returned.startswith("()"):
        return [f"({', '.join(v)})" for v in itertools.islice(itertools.product(*map(values, inner(f"<{returned[1:-1]}>"))), 6)]
    if returned.startswith(("impl ", "!", "&", "dyn ")):
        return []
    return ["Default::default()"]


def mutants_of(file, source):
    """All mutants of a file."""
    lines = source.decode().splitlines()
    found = []

    def add(at, node, change, new):
        row, column = at.start_point
        shown = len(source.splitlines()[row][:column].decode())
        found.append(Mutant(file, row + 1, shown + 1, lines[row].strip(), change, place(node), new))

    def of_function(node, name):
        body, returns = node.child_by_field_name("body"), node.child_by_field_name("return_type")
        modifiers = next((text(c) for c in node.children if c.type == "function_modifiers"), "")
        if body is None or not body.named_children or re.search(r"\b(const|async|unsafe)\b", modifiers):
            return "const" not in modifiers
        if name.endswith("::new") and text(returns) == "Self":
            return True  # a Default that calls new would never end
        returned = text(returns) if returns else ""
        arrow = f" -> {returned}" if returned else ""
        first = next((c for c in body.named_children if "comment" not in c.type), body)
        for value in values(returned):
            add(first, body, f"replace {name}{arrow} with {value}", value)
        return True

    def of_expression(node, name):
        if node.type in ("binary_expression", "compound_assignment_expr"):
            operator = node.child_by_field_name("operator")
            for new in OPERATORS.get(text(operator), "").split():
                add(operator, node, f"replace {text(operator)} with {new} in {name}", new)
        elif node.type == "unary_expression" and node.children[0].type in "-!":
            add(node, node, f"delete {node.children[0].type} in {name}", "")
        elif node.type == "match_pattern":
            of_arm(node, name)

    def of_arm(pattern, name):
        guard, arm = pattern.child_by_field_name("condition"), pattern.parent
        if guard is not None and "let" not in text(guard).split():
            for new in ("true", "false"):
                add(guard, pattern, f"replace match guard {text(guard)} with {new} in {name}", new)
        arms = [a.child_by_field_name("pattern") for a in arm.parent.named_children if a.type == "match_arm"]
        if guard is None and text(pattern) != "_" and any(text(other) == "_" for other in arms):
            add(arm, pattern, f"delete match arm {text(pattern)} in {name}", "delete")

    def walk(node, name, within):
        if node.type in LEFT_OUT or marked(node, "test", "proptest"):
            return
        if node.type == "impl_item":
            kind = text(node.child_by_field_name("type"))
            of = node.child_by_field_name("trait")
            within = f"<impl {text(of)} for {kind}>::" if of else f"{kind}::"
        elif node.type == "trait_item":
            within = f"{text(node.child_by_field_name('name'))}::"
        elif node.type == "function_item":
            name = f"{within}{text(node.child_by_field_name('name'))}"
            if not of_function(node, name):
                return
        elif name:
            of_expression(node, name)
        for child in node.named_children:
            walk(child, name, within)

    walk(PARSER.parse(source).root_node, "", "")
    return found


def woven(source, chosen):
    """The text of a file with some mutants in it (number to mutant), each between marks that bear its number."""
    at = {}
    for number, mutant in chosen.items():
        at.setdefault(mutant.node, []).append((number, mutant.new))

    def rendered(node):
        parts, end = [], node.start_byte
        for child in node.children:
            parts += [source[end : child.start_byte].decode(), rendered(child)]
            end = child.end_byte
        plain = "".join(parts) + source[end : node.end_byte].decode()
        return switched(node, at[place(node)], plain) if place(node) in at else plain

    def switched(node, changes, plain):
        ons = [f"crate::mutants::on({number})" for number, _ in changes]
        marks = ["".join(f"/*{c}{number}*/" for number, _ in changes) for c in "<>"]
        if node.type == "block":
            inside = "".join(f"if {on} {{ return {new}; }} " for on, (_, new) in zip(ons, changes))
            return f"{{{marks[0]}{inside}{marks[1]}{plain[1:]}"
        if node.type == "match_pattern":
            return f"{marks[0]}{arm(node, changes, ons, plain)}{marks[1]}"
        if node.type == "unary_expression":
            ways = [rendered(node.named_children[0])]
        else:
            left, right = (rendered(node.child_by_field_name(side)) for side in ("left", "right"))
            ways = [f"{left} {new} {right}" for _, new in changes]
        choice = "".join(f"if {on} {{ {way} }} else " for on, way in zip(ons, ways))
        return f"({marks[0]}{choice}{{ {plain} }}{marks[1]})"

    def arm(node, changes, ons, plain):
        guard = node.child_by_field_name("condition")
        if guard is None:
            return f"{plain} if !{ons[0]}"
        condition = f"({rendered(guard)})"
        for on, (_, new) in zip(ons, changes):
            condition = f"({on} || {condition})" if new == "true" else f"(!{on} && {condition})"
        return f"{rendered(node.children[0])} if {condition}"

    return rendered(PARSER.parse(source).root_node)


SWITCH = """
#[doc(hidden)]
#[allow(missing_docs, clippy::all)]
pub mod mutants {
    use std::{cell::RefCell, io::Write, sync::LazyLock};
    static CHOSEN: LazyLock<u32> = LazyLock::new(|| std::env::var("MELTPATH_MUTANT").ok().and_then(|v| v.parse().ok()).unwrap_or(0));
    static REACHED: LazyLock<Option<std::fs::File>> = LazyLock::new(|| {
        let path = std::env::var_os("MELTPATH_REACHED")?;
        std::fs::OpenOptions::new().append(true).create(true).open(path).ok()
    });
    thread_local! { static SEEN: RefCell<Vec<bool>> = const { RefCell::new(Vec::new()) }; }
    #[inline]
    pub fn on(number: u32) -> bool {
        if REACHED.is_some() { told(number); }
        *CHOSEN == number
    }
    #[cold]
    fn told(number: u32) {
        let n = number as usize;
        let known = SEEN.try_with(|seen| {
            let mut seen = seen.borrow_mut();
            if seen.len() <= n { seen.resize(n + 1, false); }
            std::mem::replace(&mut seen[n], true)
        });
        if let (Ok(false), Some(mut file)) = (known, REACHED.as_ref()) {
            let thread = std::thread::current();
            let _ = file.write_all(format!("{number} {}\\n", thread.name().unwrap_or("?")).as_bytes());
        }
    }
}
"""


def marks_around(woven_text, byte):
    """Numbers of the mutants around a place of a woven text, innermost first; of those nearest to it where none is around."""
    open_at, around, nearest = {}, [], (1 << 60, None)
    for mark in re.finditer(rb"/\*([<>])(\d+)\*/", woven_text.encode()):
        number = int(mark[2])
        nearest = min(nearest, (abs(mark.start() - byte), number))
        if mark[1] == b"<":
            open_at[number] = mark.start()
        elif open_at.get(number, 1 << 60) <= byte <= mark.end():
            around.append((mark.end() - open_at[number], number))
    smallest = min(around, default=(0, None))[0]
    return [number for size, number in around if size == smallest] or ([nearest[1]] if nearest[1] else [])
