"""What the reports share: tables, figures, HTML."""
