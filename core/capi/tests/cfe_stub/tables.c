/* The stub of cfe.h: tables, whose files are linked. */
#include "stub.h"

#include <string.h>

static struct {
    const struct StubTableFile *file;
    CFE_TBL_CallbackFuncPtr_t validate;
    bool is_new, is_updated;
} tables[2];
static const char *names[2];
static int16 table_count;

CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *TblHandlePtr, const char *Name, size_t Size, uint16 TblOptionFlags,
                              CFE_TBL_CallbackFuncPtr_t TblValidationFuncPtr) {
    (void)Size, (void)TblOptionFlags;
    names[table_count] = Name;
    tables[table_count].validate = TblValidationFuncPtr;
    *TblHandlePtr = table_count++;
    return CFE_SUCCESS;
}

/* Takes a table if its owner finds it valid. */
static CFE_Status_t take(int16 table, const struct StubTableFile *file) {
    CFE_Status_t status = tables[table].validate(file->Object);
    if (status == CFE_SUCCESS) {
        tables[table].file = file;
        tables[table].is_updated = true;
    }
    return status;
}

CFE_Status_t CFE_TBL_Load(CFE_TBL_Handle_t TblHandle, CFE_TBL_SrcEnum_t SrcType, const void *SrcDataPtr) {
    const struct StubTableFile *known[2] = {&StubFile_MissionTable, &StubFile_OptionsTable};
    int i;
    for (i = 0; i < 2 && SrcType == CFE_TBL_SRC_FILE; i++) {
        if (strcmp((const char *)SrcDataPtr + strlen("/cf/"), known[i]->FileName) == 0) {
            return take(TblHandle, known[i]);
        }
    }
    return -1;
}

static const struct StubTableFile *loaded[2];

void StubLoadTable(const struct StubTableFile *File) {
    int16 i;
    for (i = 0; i < table_count; i++) {
        if (strcmp(strchr(File->TableName, '.') + 1, names[i]) == 0) {
            loaded[i] = File;
        }
    }
}

CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t TblHandle) {
    const struct StubTableFile *file = loaded[TblHandle];
    loaded[TblHandle] = NULL;
    return file == NULL ? CFE_SUCCESS : take(TblHandle, file);
}
CFE_Status_t CFE_TBL_GetAddress(void **TblPtr, CFE_TBL_Handle_t TblHandle) {
    bool is_updated = tables[TblHandle].is_updated;
    tables[TblHandle].is_updated = false;
    *TblPtr = tables[TblHandle].file->Object;
    return is_updated ? CFE_TBL_INFO_UPDATED : CFE_SUCCESS;
}
CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t TblHandle) {
    (void)TblHandle;
    return CFE_SUCCESS;
}
