/*
 * The part of the sandbox of model files that is written in Lua. Runs once, with the module, a function that
 * compiles a file beside the model, one that marks tables, which such a file takes, and table.sort as
 * arguments; what it leaves in its globals, script.c gives to the model.
 *
 * `pairs` goes through a table in one order on every run: numbers upward, then names.
 */
#ifndef REFDYN_GEN_SANDBOX_H
#define REFDYN_GEN_SANDBOX_H

static const char sandbox_source[] =
    "local rd, compile_beside, mark_table, sort = ...\n"
    "local each, type, error, rawget, match = next, type, error, rawget, string.match\n"
    "\n"
    "local function sorted_keys(t)\n"
    "  local keys, names = {}, {}\n"
    "  for key in each, t do\n"
    "    local kind = type(key)\n"
    "    if kind ~= 'number' and kind ~= 'string' then\n"
    "      error('pairs: a key of type ' .. kind .. ', numbers and names have an order', 0)\n"
    "    end\n"
    "    local list = kind == 'number' and keys or names\n"
    "    list[#list + 1] = key\n"
    "  end\n"
    "  sort(keys)\n"
    "  sort(names)\n"
    "  for i = 1, #names do keys[#keys + 1] = names[i] end\n"
    "  return keys\n"
    "end\n"
    "\n"
    "function pairs(t)\n"
    "  local kind = type(t)\n"
    "  if kind == 'userdata' then error('pairs: an expression or a group of values, a table is needed', 0) "
    "end\n"
    "  if kind ~= 'table' then error('pairs: ' .. kind .. ', a table is needed', 0) end\n"
    "  local keys, at = sorted_keys(t), 0\n"
    "  return function()\n"
    "    local key, value\n"
    "    repeat\n"
    "      at = at + 1\n"
    "      key = keys[at]\n"
    "      value = key ~= nil and rawget(t, key)\n"
    "    until value ~= nil\n"
    "    if key ~= nil then return key, value end\n"
    "  end, t\n"
    "end\n"
    "\n"
    "local loaded = { refdyn = rd }\n"
    "function require(name)\n"
    "  if type(name) ~= 'string' or not match(name, '^[%a_][%w_]*$') then\n"
    "    error('require: only \"refdyn\" and files beside the model, by their names without .lua, can be '\n"
    "      .. 'required', 0)\n"
    "  end\n"
    "  if loaded[name] == nil then\n"
    "    local run = compile_beside(name)\n"
    "    loaded[name] = false\n"
    "    local result, more = run(mark_table)\n"
    "    if more ~= nil then error('require: \"' .. name .. '\" returns two values, one is needed', 0) end\n"
    "    loaded[name] = result == nil and true or result\n"
    "  elseif not loaded[name] then\n"
    "    error('require: \"' .. name .. '\" requires itself, by way of others or at once', 0)\n"
    "  end\n"
    "  return loaded[name]\n"
    "end\n";

#endif
