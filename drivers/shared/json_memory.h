/* json_memory.h: whether jansson ever lacked memory: an object that it could not add to lacks a key, and nothing says
 * so. */
#ifndef FLESH_SHARED_JSON_MEMORY_H
#define FLESH_SHARED_JSON_MEMORY_H

/* Before any other call of jansson. */
void flesh_json_watch(void);
/* Memory ran out for what should have become JSON. */
void flesh_json_note_lack(void);
/* Whether memory has run out since: what was made of JSON may not be whole. */
int flesh_json_lacks(void);

#endif
