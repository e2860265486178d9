"""Controllers at work, in a window or a video."""
