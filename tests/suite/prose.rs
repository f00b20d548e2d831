//! Tests of wording: every message of the program is listed in `tests/messages.txt`, and messages,
//! doc comments and guides avoid openers without a verb and words of people.

use proc_macro2::{TokenStream, TokenTree};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// First words of a doc comment that has no subject or no verb.
const OPENERS: [&str; 11] =
    ["What", "Of", "As", "Which", "Who", "Whom", "Whose", "How", "Than", "None", "That"];

/// Words that hide the thing behind a person, or a source behind a choice.
const AVOIDED: [&str; 7] =
    ["nobody", "somebody", "someone", "whoever", "told", "hears", "(chosen)"];

/// Largest number of words of a sentence in the pages that a newcomer reads first.
const SENTENCE_MAX: usize = 35;

/// Largest numbers of words of the guides, and of those that are generated.
const WORDS_MAX: [usize; 2] = [25_000, 9_000];

/// Largest numbers of words of pages of measurements, which the others do not include.
const MEASURED: [(&str, usize); 2] = [("speed.md", 900), ("real-touches.md", 700)];

const GENERATED: [&str; 2] = ["hard-cases.md", "reference.md"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` with an `extension`, sorted.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .flat_map(|path| if path.is_dir() { files(&path, extension) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|is| is == extension))
        .collect();
    files.sort();
    files
}

/// Texts of a source file outside its unit tests.
#[derive(Default)]
struct Texts {
    /// First lines of doc comments.
    openers: Vec<String>,
    docs: Vec<String>,
    literals: Vec<String>,
}

impl Texts {
    fn collect(&mut self, tokens: TokenStream) {
        let mut tokens = tokens.into_iter().peekable();
        let mut is_after_doc = false;
        while let Some(token) = tokens.next() {
            match token {
                TokenTree::Punct(mark) if mark.as_char() == '#' => {
                    tokens.next_if(|next| matches!(next, TokenTree::Punct(_)));
                    let Some(TokenTree::Group(attribute)) = tokens.next() else { continue };
                    let text = attribute.stream().to_string();
                    if text == "cfg (test)" {
                        // Skips the item up to its body.
                        tokens.by_ref().find(|token| matches!(token, TokenTree::Group(_)));
                        is_after_doc = false;
                    } else if let Some(doc) = text.strip_prefix("doc = ") {
                        let doc = doc.trim_matches(['r', '#']).trim_matches('"').trim().to_owned();
                        if !is_after_doc {
                            self.openers.push(doc.clone());
                        }
                        self.docs.push(doc);
                        is_after_doc = true;
                    } else {
                        self.collect(attribute.stream());
                    }
                    continue;
                }
                TokenTree::Group(group) => self.collect(group.stream()),
                TokenTree::Literal(literal) => {
                    let text = literal.to_string();
                    let text = text.trim_start_matches('r').trim_matches('#');
                    if let Some(text) = text.strip_prefix('"').and_then(|it| it.strip_suffix('"')) {
                        self.literals.push(joined(text));
                    }
                }
                _ => {}
            }
            is_after_doc = false;
        }
    }
}

/// Joins the lines of a literal that end with a backslash.
fn joined(text: &str) -> String {
    let mut lines = text.split("\\\n");
    let first = lines.next().unwrap().to_owned();
    lines.fold(first, |joined, line| joined + line.trim_start())
}

/// Whether a literal is a sentence or a part of one: at least two words, no markup.
fn is_message(text: &str) -> bool {
    let is_word = |word: &&str| word.chars().filter(char::is_ascii_lowercase).count() > 1;
    !text.contains(['<', '\n']) && text.split_whitespace().filter(is_word).count() > 1
}

/// Texts of every source file of the program.
fn sources() -> BTreeMap<String, Texts> {
    let crates = fs::read_dir(root().join("crates")).unwrap();
    let folders = crates.map(|entry| entry.unwrap().path().join("src"));
    let folders = folders.chain([root().join("src"), root().join("python/src")]);
    let mut sources = BTreeMap::new();
    for path in folders.flat_map(|folder| files(&folder, "rs")) {
        let mut texts = Texts::default();
        texts.collect(fs::read_to_string(&path).unwrap().parse().unwrap());
        let name = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
        sources.insert(name, texts);
    }
    sources
}

/// Returns the first word of `text` that is avoided.
fn avoided(text: &str) -> Option<&'static str> {
    let is = |part: &str, word: &str| {
        let part = part.trim_matches(|c: char| !c.is_alphanumeric() && !"()".contains(c));
        part.eq_ignore_ascii_case(word) || part.trim_matches(['(', ')']).eq_ignore_ascii_case(word)
    };
    AVOIDED.into_iter().find(|word| text.split_whitespace().any(|part| is(part, word)))
}

/// Prose of a page: without code, tables and headings.
fn prose(page: &str) -> String {
    let blocks = page.split("```").step_by(2);
    let lines = blocks.flat_map(str::lines).filter(|line| !line.starts_with(['|', '#', '<']));
    lines.map(|line| line.to_owned() + "\n").collect()
}

#[test]
fn messages_are_listed() {
    let mut list = String::new();
    for (name, texts) in sources() {
        let messages: Vec<_> = texts.literals.iter().filter(|text| is_message(text)).collect();
        if !messages.is_empty() {
            writeln!(list, "\n{name}").unwrap();
            messages.iter().for_each(|text| writeln!(list, "  {}", text.trim()).unwrap());
        }
    }
    let path = root().join("tests/messages.txt");
    if std::env::var_os("PALPATE_WRITE_MESSAGES").is_some() {
        fs::write(&path, &list).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    for (ours, kept) in list.lines().zip(kept.lines().chain(std::iter::repeat(""))) {
        assert_eq!(ours, kept, "tests/messages.txt differs: run `make texts` and read the change");
    }
    assert_eq!(list.len(), kept.len());
}

#[test]
fn doc_comments_begin_with_a_subject_or_a_verb() {
    let mut wrong = Vec::new();
    for (name, texts) in sources() {
        let has_bad_opener = |doc: &&String| OPENERS.contains(&doc.split(' ').next().unwrap());
        let openers = texts.openers.iter().filter(has_bad_opener);
        wrong.extend(openers.map(|opener| format!("{name}: {opener}")));
    }
    assert!(wrong.is_empty(), "begin with a noun or a verb:\n{}", wrong.join("\n"));
}

#[test]
fn prose_names_things_instead_of_people() {
    let mut texts: Vec<(String, String)> = Vec::new();
    for (name, source) in sources() {
        let lines =
            source.docs.into_iter().chain(source.literals.into_iter().filter(|t| is_message(t)));
        texts.extend(lines.map(|line| (name.clone(), line)));
    }
    for page in files(&root().join("docs"), "md").into_iter().chain([root().join("README.md")]) {
        let text = fs::read_to_string(&page).unwrap();
        texts.extend(text.lines().map(|line| (page.display().to_string(), line.to_owned())));
    }
    // Stored recordings contain this text byte for byte.
    texts.retain(|(_, text)| !text.starts_with("# Of each frame"));
    let wrong: Vec<_> = texts
        .iter()
        .filter_map(|(name, text)| Some(format!("{name}: \"{}\" in {text}", avoided(text)?)))
        .collect();
    assert!(wrong.is_empty(), "use the field's noun:\n{}", wrong.join("\n"));
}

#[test]
fn guides_are_short() {
    let mut words = [0; 2];
    for page in files(&root().join("docs"), "md") {
        let name = page.file_name().unwrap().to_str().unwrap();
        let count = fs::read_to_string(&page).unwrap().split_whitespace().count();
        if let Some((_, most)) = MEASURED.iter().find(|(measured, _)| *measured == name) {
            assert!(count <= *most, "{count} of {most} in {name}");
            continue;
        }
        words[0] += count;
        words[1] += if GENERATED.contains(&name) { count } else { 0 };
    }
    assert!(words[0] <= WORDS_MAX[0] && words[1] <= WORDS_MAX[1], "{words:?} of {WORDS_MAX:?}");
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.split_whitespace().count() <= 450);
}

#[test]
fn first_pages_have_short_sentences() {
    for name in ["README.md", "docs/install.md", "docs/first-experiment.md"] {
        let page = fs::read_to_string(root().join(name)).unwrap();
        for paragraph in prose(&page).split("\n\n") {
            let items = paragraph.split("\n- ").flat_map(|item| item.split(['.', '?', '!', ':']));
            let count = |text: &str| text.split_whitespace().count();
            let longest = items.max_by_key(|text| count(text)).unwrap_or_default();
            assert!(count(longest) <= SENTENCE_MAX, "{name}: a long sentence: {longest}");
        }
    }
}
