"""What several commands share: points, results, files, progress, screw and friction set of the options."""
