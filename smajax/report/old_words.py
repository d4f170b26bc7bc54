"""The functions that `smajax.core.old_words` asks for, until version 0.3."""

from smajax.report.identifiability_words import check_sentences as check_sentences
from smajax.report.identifiability_words import direction_sentence as direction_sentence
from smajax.report.identifiability_words import remark_text as remark_text
from smajax.report.identifiability_words import weak_combinations as weak_combinations
from smajax.report.identify_words import ended_sentence as ended_sentence
from smajax.report.tune_words import goal_sentence as goal_sentence
from smajax.report.tune_words import held_out_sentence as held_out_sentence
from smajax.report.tune_words import plants_sentence as plants_sentence
