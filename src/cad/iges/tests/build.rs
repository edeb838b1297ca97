//! Writes small IGES files for tests.

/// An entity: type, form, matrix pointer, parameters behind the type number. Entity i has the pointer 2 i + 1.
pub(super) struct Item {
    pub kind: u32,
    pub form: i32,
    pub matrix: u32,
    pub text: String,
}

/// An entity without matrix.
pub(super) fn item(kind: u32, form: i32, text: impl Into<String>) -> Item {
    Item { kind, form, matrix: 0, text: text.into() }
}

/// An entity with a matrix.
pub(super) fn moved(kind: u32, form: i32, matrix: u32, text: impl Into<String>) -> Item {
    Item { kind, form, matrix, text: text.into() }
}

/// The cards (80 columns each) of a file in mm.
pub(super) fn cards(items: &[Item]) -> Vec<String> {
    cards_in(items, "1.,2,2HMM")
}

/// The cards of a file with these scale and unit fields.
pub(super) fn cards_in(items: &[Item], unit: &str) -> Vec<String> {
    let mut out = vec![format!("{:72}S{:7}", "test", 1)];
    let global = format!(
        ",,4Htest,4Hfile,4HSYST,3HPRE,32,38,6,308,15,4Htest,{unit},1,0.5,5H20260,0.001,9.;"
    );
    out.extend(
        global
            .as_bytes()
            .chunks(72)
            .enumerate()
            .map(|(i, c)| format!("{:72}G{:7}", std::str::from_utf8(c).unwrap(), i + 1)),
    );
    let mut parameters = Vec::new();
    for (i, item) in items.iter().enumerate() {
        let pointer = 2 * i + 1;
        let text = format!("{},{};", item.kind, item.text);
        let first = parameters.len() + 1;
        let chunks = text.as_bytes().chunks(64);
        let count = chunks.len();
        for chunk in chunks {
            let n = parameters.len() + 1;
            parameters
                .push(format!("{:64} {pointer:7}P{n:7}", std::str::from_utf8(chunk).unwrap()));
        }
        let (kind, matrix) = (item.kind, item.matrix);
        let zeros = format!("{0:8}{0:8}{0:8}{0:8}", 0);
        out.push(format!("{kind:8}{first:8}{zeros}{matrix:8}{:8}00000000D{pointer:7}", 0));
        out.push(format!(
            "{kind:8}{0:8}{0:8}{count:8}{1:8}{0:32}D{2:7}",
            0,
            item.form,
            pointer + 1
        ));
    }
    let total = parameters.len();
    out.extend(parameters);
    out.push(format!("S{:7}G{:7}D{:7}P{total:7}{:40}T{:7}", 1, 1, 2 * items.len(), "", 1));
    out
}

/// The bytes of a file in mm.
pub(super) fn file(items: &[Item]) -> Vec<u8> {
    cards(items).join("\n").into_bytes()
}
