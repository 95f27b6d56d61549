/* Of the stub in cfe.h: a table's file is its object. */
#ifndef CFE_STUB_TBL_FILEDEF_H
#define CFE_STUB_TBL_FILEDEF_H

#include "cfe.h"

#define CFE_TBL_FILEDEF(ObjName, TblName, Desc, Filename) \
    const struct StubTableFile StubFile_##ObjName = {#TblName, #Filename, &ObjName, sizeof(ObjName)};
struct StubTableFile { const char *TableName, *FileName; void *Object; size_t Size; };
extern const struct StubTableFile StubFile_MissionTable, StubFile_OptionsTable;

#endif
