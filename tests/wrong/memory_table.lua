-- expect: 0: more than 256 MB of memory to read the model
local list = {}
for i = 1, 1e9 do
  list[i] = i
end
