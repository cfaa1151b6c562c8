"""What a trial leaves on disk: schema, writer, reader."""
