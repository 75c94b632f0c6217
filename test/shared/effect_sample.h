/* effect_sample.h: the effects that scenes can name, each with sample parameters. */
#ifndef FLESH_TEST_EFFECT_SAMPLE_H
#define FLESH_TEST_EFFECT_SAMPLE_H

#include "body.h"
#include "scene/effect_registry.h"
#include "scene/keys.h"
#include "test.h"

/* Reads a row's sample as a scene would, on a body, for a system that will take it. Returns its status. */
static inline int test_try_sample(const flesh_effect_row *row, const flesh_body *body, flesh_system *system)
{
  flesh_arena arena = {0};
  flesh_node *root = NULL;
  flesh_source source = {.name = row->name};
  CHECK_OK(flesh_yaml_parse(&arena, row->sample, strlen(row->sample), &source, &root));
  void *parameters = flesh_arena_take(&arena, row->parameters_size);
  flesh_key_reader reader = {.arena = &arena};
  CHECK_OK(flesh_keys_read(&reader, row->keys, root, root, row->name, parameters));
  const int status = row->add(parameters, body, system);
  flesh_arena_free(&arena);
  return status;
}

/* Adds a row's sample to the body's system. */
static inline void test_add_sample(const flesh_effect_row *row, test_body *b)
{
  CHECK_OK(test_try_sample(row, &b->body, b->system));
}

#endif
