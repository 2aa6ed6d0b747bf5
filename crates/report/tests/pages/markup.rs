//! What every page must be: markup that closes, colours that have a rule.

/// Elements that have no end tag.
const VOID: [&str; 3] = ["meta", "br", "input"];

/// Opening and closing tags match and every quote is closed; returns the number of elements.
pub fn balanced(html: &str) -> Result<usize, String> {
    let (mut open, mut count, mut rest) = (Vec::new(), 0, html);
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        let end = rest.find('>').ok_or("a tag without an end")?;
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        if tag.starts_with('!') {
            continue;
        }
        if tag.matches('"').count() % 2 == 1 || tag.contains('<') {
            return Err(format!("broken tag <{tag}>"));
        }
        if let Some(name) = tag.strip_prefix('/') {
            let expected = open.pop();
            if expected != Some(name) {
                return Err(format!("</{name}> closes {expected:?}"));
            }
            continue;
        }
        count += 1;
        let name = tag.split([' ', '/']).next().unwrap_or_default();
        if let "style" | "script" = name {
            rest = rest.split_once(&format!("</{name}>")).ok_or("style or script without an end")?.1;
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    if open.is_empty() { Ok(count) } else { Err(format!("never closed: {open:?}")) }
}

/// Words on the page: no tags, no style, no script.
pub fn words(html: &str) -> String {
    let body = html.split_once("</style>").map_or(html, |(_, body)| body);
    let readable: String =
        body.split("<script").map(|piece| piece.split_once("</script>").map_or(piece, |(_, text)| text)).collect();
    readable.split('<').map(|piece| piece.split_once('>').map_or(piece, |(_, text)| text)).collect::<Vec<_>>().join(" ")
}

/// Each colour of the drawings is replaced by the style sheet; returns how many there are.
pub fn colours_have_rules(html: &str) -> usize {
    let (style, body) = html.split_once("</style>").unwrap();
    let mut count = 0;
    for attribute in ["fill", "stroke"] {
        let open = format!(" {attribute}=\"#");
        let colours: std::collections::BTreeSet<_> = body.split(&open).skip(1).map(|rest| &rest[..6]).collect();
        count += colours.len();
        for colour in colours {
            assert!(style.contains(&format!("svg [{attribute}=\"#{colour}\"]")), "{attribute} #{colour}");
        }
    }
    count
}

/// Tests cannot see: the page stays in `target/tmp` for whoever can.
pub fn keep_for_a_look(html: &str, name: &str) {
    std::fs::write(format!("{}/{name}.html", env!("CARGO_TARGET_TMPDIR")), html).unwrap();
}

#[test]
fn the_checker_of_this_file_finds_broken_pages() {
    assert_eq!(balanced("<p><b>a</b><br><i/></p>"), Ok(4));
    for broken in ["<p>", "<p></b></p>", "<p class=\"a></p>", "</p>", "<p"] {
        assert!(balanced(broken).is_err(), "{broken}");
    }
}
