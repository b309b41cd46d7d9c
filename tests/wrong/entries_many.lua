-- expect: 3: more than 10000 entries in a table
local rd = require "refdyn"
local t = {}
for i = 1, 10001 do t[i] = { "p" .. i, 1 } end
local p = rd.parameters(t)
