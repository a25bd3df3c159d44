//! The table that a bench prints.

use super::{Figures, Group};

/// Prints the figures of `groups`, which [`measure`](super::measure) found.
pub(crate) fn print(groups: &[Group], figures: &[Figures]) {
    let mut rest = figures;
    for group in groups {
        let (figures, more) = rest.split_at(group.subjects.len());
        rest = more;
        print_group(group, figures);
    }
}

fn print_group(group: &Group, figures: &[Figures]) {
    print!("\n{:<34}{:>9}{:>9}", group.title, "ns", "min ns");
    for reference in group.references {
        print!("{:>1$}", format!("x {reference}"), column(reference));
    }
    println!("{:>14}", "instructions");
    for (subject, own) in group.subjects.iter().zip(figures) {
        let time = own.nanoseconds;
        print!("  {:<32}{:>9.1}{:>9.1}", subject.name, time.median, time.min);
        for reference in group.references {
            let ratio = group
                .subjects
                .iter()
                .position(|subject| subject.name == *reference)
                .map(|at| time.median / figures[at].nanoseconds.median);
            print!("{:>1$}", shown(ratio, 2), column(reference));
        }
        println!("{:>14}", shown(own.instructions, 1));
    }
}

/// Width of the column of a reference.
fn column(reference: &str) -> usize {
    reference.len() + "  x ".len()
}

fn shown(figure: Option<f64>, decimals: usize) -> String {
    figure.map_or_else(|| "-".to_owned(), |figure| format!("{figure:.decimals$}"))
}
