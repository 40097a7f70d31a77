"""What every part uses: errors, arguments, text, atomic files."""
