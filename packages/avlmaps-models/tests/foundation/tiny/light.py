"""The files of the profile ``light``, exported from tiny random checkpoints in the published layouts."""

from pathlib import Path

SHORT_SIDE = 56


def write_light_sources(folder: Path) -> None:
    """Write a tiny TIPSv2 and a tiny CLAP under the names from which the profile is made."""
    from transformers import Tipsv2Config, Tipsv2Model, Tipsv2TextConfig, Tipsv2VisionConfig

    from tiny.clap import write_clap
    from tiny.tipsv2 import shake, without_temperature, write_tips_tokens

    place = folder / "google/tipsv2-b14"
    place.mkdir(parents=True)
    vision = Tipsv2VisionConfig(hidden_size=64, num_hidden_layers=3, num_attention_heads=4, image_size=70)
    text = Tipsv2TextConfig(
        hidden_size=64, intermediate_size=128, num_hidden_layers=2, num_attention_heads=4, vocab_size=300
    )
    made = Tipsv2Model(Tipsv2Config(text_config=text, vision_config=vision, temperature_init_value=0.005))
    shake(made, 3, 0.15)
    made.save_pretrained(place)
    without_temperature(place / "model.safetensors")
    write_tips_tokens(place)
    write_clap(folder, "laion/clap-htsat-unfused")


def export_light(models: Path, out: Path, *words: str) -> int:
    """Export them; return the status."""
    import tyro
    from training.light.__main__ import Options, main

    options = ("--out", str(out), "--models", str(models), "--short-side", str(SHORT_SIDE), "--most-phrases", "40")
    return main(tyro.cli(Options, args=[*options, *words]))
