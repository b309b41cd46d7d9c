/*
 * The sandbox of model files, in Lua: what it takes away and what it puts instead. Runs before the model,
 * with the module and a function that tells expressions as arguments.
 *
 * `pairs` goes through a table in one order on every run: numbers upward, then names. math.* of an expression
 * would fail with a puzzle; it names the function to use.
 */
#ifndef REFDYN_GEN_SANDBOX_H
#define REFDYN_GEN_SANDBOX_H

static const char sandbox_source[] =
    "local rd, is_expression = ...\n"
    "local next, type, error, ipairs, rawget, select = next, type, error, ipairs, rawget, select\n"
    "local sort = table.sort\n"
    "\n"
    "local function sorted_keys(t)\n"
    "  local keys, names = {}, {}\n"
    "  for key in next, t do\n"
    "    local kind = type(key)\n"
    "    if kind ~= 'number' and kind ~= 'string' then\n"
    "      error('pairs: a key of type ' .. kind .. ', numbers and names have an order', 3)\n"
    "    end\n"
    "    local list = kind == 'number' and keys or names\n"
    "    list[#list + 1] = key\n"
    "  end\n"
    "  sort(keys)\n"
    "  sort(names)\n"
    "  for _, name in ipairs(names) do keys[#keys + 1] = name end\n"
    "  return keys\n"
    "end\n"
    "\n"
    "function pairs(t)\n"
    "  if type(t) ~= 'table' then error('pairs: ' .. type(t) .. ', a table is needed', 2) end\n"
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
    "local function guarded(name, original)\n"
    "  local instead = rawget(rd, name) and ': use rd.' .. name\n"
    "      or ': its value is not known while the model is read'\n"
    "  return function(...)\n"
    "    for i = 1, select('#', ...) do\n"
    "      if is_expression((select(i, ...))) then\n"
    "        error('math.' .. name .. ' of an expression' .. instead, 2)\n"
    "      end\n"
    "    end\n"
    "    return original(...)\n"
    "  end\n"
    "end\n"
    "\n"
    "for name, original in pairs(math) do\n"
    "  if type(original) == 'function' then math[name] = guarded(name, original) end\n"
    "end\n"
    "math.random, math.randomseed, string.dump = nil, nil, nil\n"
    "collectgarbage, dofile, load, loadfile, next, pcall, print, warn, xpcall = nil\n"
    "\n"
    "function require(name)\n"
    "  if name ~= 'refdyn' then error('require: only \"refdyn\" can be required', 2) end\n"
    "  return rd\n"
    "end\n";

#endif
