"""What every command needs: errors, files, interrupts, progress."""
