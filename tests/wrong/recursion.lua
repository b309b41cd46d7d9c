-- expect: 3: stack overflow: a function calls itself without an end; return without a call in the last case
local function f(n)
  return 1 + f(n + 1)
end
return f(1)
