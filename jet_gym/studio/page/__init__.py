"""What stands around the studio's scene: the panel, the table and the plots."""
